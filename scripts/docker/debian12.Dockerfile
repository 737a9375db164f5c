# Debian 12: ROS of Debian's own packages, this package, and a user without rights (docs/getting_started.md). From the checkout:
#   docker build -f scripts/docker/debian12.Dockerfile -t diff_encoder_sim .
#   docker run --rm -it diff_encoder_sim
FROM debian:bookworm-slim

# pip trusts the system's certificates
RUN apt-get update && apt-get install -y --no-install-recommends ca-certificates
RUN useradd --create-home robot
COPY --chown=robot . /home/robot/diff_encoder_sim
RUN bash /home/robot/diff_encoder_sim/scripts/setup.sh && rm -rf /var/lib/apt/lists/* /home/robot/.cache

USER robot
WORKDIR /home/robot
ENTRYPOINT ["bash", "/home/robot/diff_encoder_sim/scripts/docker/entrypoint.sh"]
CMD ["bash"]
