// The table of figures in the corner of the page.
const INTERVAL = 0.5; // seconds between two updates of the measured rate

export class Statistics {
  constructor(panel, take) {
    this.cells = {};
    this.frames = 0;
    this.seconds = 0;
    const table = document.createElement('table');
    for (const [name, value] of [...Object.entries(take.statistics), ['Triangles shown', ''], ['Vertices shown', ''], ['Pictures a second', '']]) {
      const row = table.insertRow();
      row.insertCell().textContent = name;
      this.cells[name] = row.insertCell();
      this.cells[name].textContent = value;
    }
    panel.replaceChildren(table);
  }

  // Takes note of a picture that was drawn.
  count(seconds, viewer) {
    this.frames += 1;
    this.seconds += seconds;
    if (this.seconds < INTERVAL && this.cells['Triangles shown'].textContent) return;
    const geometries = viewer.shownMeshes().map((mesh) => mesh.geometry);
    const sum = (values) => values.reduce((total, value) => total + value, 0);
    this.cells['Triangles shown'].textContent = sum(geometries.map((geometry) => geometry.index.count / 3));
    this.cells['Vertices shown'].textContent = sum(geometries.map((geometry) => geometry.attributes.position.count));
    this.cells['Pictures a second'].textContent = this.seconds > 0 ? (this.frames / this.seconds).toFixed(0) : '';
    this.frames = 0;
    this.seconds = 0;
  }
}
