// The matrix: a measure is picked, a cell is clicked for its details. Everything is text built here from the page's data.
function createMatrix(root, matrix) {
  const make = (tag, cls, text) => {
    const element = document.createElement(tag);
    if (cls) element.className = cls;
    if (text !== undefined) element.textContent = text;
    return element;
  };
  const head = make("div", "matrix-head"), picker = make("select"), about = make("p", "matrix-about");
  const label = make("label", "", "Measure ");
  picker.setAttribute("aria-label", "Measure");
  matrix.measures.forEach((measure, i) => { const option = make("option", "", measure.name); option.value = i; picker.append(option); });
  label.append(picker);
  head.append(make("h2", "", matrix.title), label, about);
  const frame = make("div", "matrix-frame"), table = make("table"), details = make("aside", "matrix-details");
  frame.append(table);
  const top = make("tr");
  top.append(make("td"));
  for (const name of matrix.columns) {
    const column = make("th");
    column.scope = "col";
    column.append(make("span", "", name));
    top.append(column);
  }
  const thead = make("thead"), body = make("tbody");
  thead.append(top);
  table.append(thead, body);
  const cells = [];
  for (const row of matrix.rows) {
    const line = make("tr"), name = make("th", "", row.name);
    name.scope = "row";
    line.append(name);
    row.cells.forEach((cell, c) => {
      const place = make("td");
      line.append(place);
      if (!cell) return;
      const button = make("button", "cell");
      button.type = "button";
      place.append(button);
      button.addEventListener("click", () => show(row.name, matrix.columns[c], cell, button));
      cells.push({ button, cell, title: `${row.name}, ${matrix.columns[c]}` });
    });
    body.append(line);
  }
  function show(row, column, cell, button) {
    for (const other of cells) other.button.classList.toggle("chosen", other.button === button);
    const list = make("dl");
    for (const [what, value] of cell.details) list.append(make("dt", "", what), make("dd", "", value));
    details.replaceChildren(make("h2", "", `${row} \u00b7 ${column}`), list);
    for (const [text, href] of cell.links) {
      const link = make("a", "", text);
      link.href = href;
      const line = make("p");
      line.append(link);
      details.append(line);
    }
  }
  function pick(index) {
    const measure = matrix.measures[index], [worst, best] = measure.shade;
    about.textContent = measure.about;
    for (const { button, cell, title } of cells) {
      const [value, low, high] = cell.values[index], text = v => v.toFixed(measure.digits);
      button.replaceChildren(make("b", "", value === null ? "\u2013" : text(value)));
      if (low !== null && high !== null) button.append(make("small", "", `${text(low)}\u2013${text(high)}`));
      button.title = title;
      button.setAttribute("aria-label", `${title}: ${value === null ? "no value" : text(value)}`);
      const share = value === null || best === worst ? null : Math.min(1, Math.max(0, (value - worst) / (best - worst)));
      button.style.setProperty("--share", share === null ? 0 : share);
      button.classList.toggle("empty", share === null);
    }
  }
  picker.addEventListener("change", () => pick(Number(picker.value)));
  details.append(make("p", "prompt", "Click a cell for all that was measured there."));
  root.append(head, frame, details);
  pick(0);
  // #measure=3 shows another measure, #cell=5 opens a cell: for links and screenshots.
  const wanted = new URLSearchParams(location.hash.slice(1)), measure = Number(wanted.get("measure") || 0);
  if (matrix.measures[measure]) { picker.value = measure; pick(measure); }
  if (wanted.has("cell") && cells[wanted.get("cell")]) cells[wanted.get("cell")].button.click();
}
