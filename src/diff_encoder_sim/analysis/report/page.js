'use strict';

// Sort a table by the clicked column; a second click reverses the order.
function sortBy(button) {
  const head = button.closest('th');
  const table = head.closest('table');
  const column = head.cellIndex;
  const ascending = head.getAttribute('aria-sort') !== 'ascending';
  for (const other of head.parentElement.children) {
    other.removeAttribute('aria-sort');
  }
  head.setAttribute('aria-sort', ascending ? 'ascending' : 'descending');
  const key = (row) => row.cells[column].textContent.trim();
  const order = (one, other) => {
    const [a, b] = [Number(key(one)), Number(key(other))];
    if (Number.isNaN(a) !== Number.isNaN(b)) {
      return Number.isNaN(a) ? 1 : -1;      // missing numbers last in both orders
    }
    return (Number.isNaN(a) ? key(one).localeCompare(key(other)) : a - b) * (ascending ? 1 : -1);
  };
  const body = table.tBodies[0];
  body.append(...[...body.rows].sort(order));
}

for (const button of document.querySelectorAll('th button')) {
  button.addEventListener('click', () => sortBy(button));
}

// Mark the boxes that are narrower than their table or figure.
const boxes = new ResizeObserver((changed) => {
  for (const {target} of changed) {
    target.classList.toggle('scrolls', target.scrollWidth > target.clientWidth);
  }
});
document.querySelectorAll('.wide').forEach((box) => boxes.observe(box));

// Open all details for printing, but for those of the screen alone and those that are summarized.
let unfolded = [];
addEventListener('beforeprint', () => {
  unfolded = [...document.querySelectorAll('details:not([open], .screen, .folded)')];
  for (const details of unfolded) {
    details.open = true;
  }
});
addEventListener('afterprint', () => {
  for (const details of unfolded) {
    details.open = false;
  }
});
