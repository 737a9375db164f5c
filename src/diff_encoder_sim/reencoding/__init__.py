"""What a recorded drive would have looked like with other encoders."""
