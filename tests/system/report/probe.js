// Runs in a page beside the report, which is in a frame of the same origin, and prints what it finds as JSON
// into #result: sentences on what is wrong, and the values that the test compares.
'use strict';

function boxesOfTexts(plot) {
  return Array.from(plot.querySelectorAll('text'))
      .filter(text => text.textContent !== '' && text.getBoundingClientRect().width > 0)
      .map(text => ({text: text.textContent, box: text.getBoundingClientRect()}));
}

function overlap(a, b) {
  const slack = 1;  // boxes of lines of text are taller than their letters
  return a.left + slack < b.right && b.left + slack < a.right && a.top + slack < b.bottom &&
      b.top + slack < a.bottom;
}

function faultsOfTexts(plot, where) {
  const faults = [];
  const texts = boxesOfTexts(plot);
  const card = plot.closest('.card').getBoundingClientRect();
  texts.forEach(({text, box}, i) => {
    if (box.left < card.left || box.right > card.right) faults.push(`${where}: "${text}" leaves its card`);
    for (const other of texts.slice(i + 1)) {
      // A title within a text is no text of the picture.
      if (overlap(box, other.box)) faults.push(`${where}: "${text}" overlaps "${other.text}"`);
    }
  });
  if (texts.length === 0) faults.push(`${where}: no text`);
  return faults;
}

function faultsOfLines(plot, where) {
  const faults = [];
  const lines = Array.from(plot.querySelectorAll('.viewport path[data-names]'));
  if (lines.length === 0) faults.push(`${where}: no line of a signal`);
  for (const line of lines) {
    const width = line.getBoundingClientRect().width;
    const available = line.ownerSVGElement.getBoundingClientRect().width;
    // A dot replaces a line that is too short.
    const isDot = line.nextElementSibling?.classList.contains('single');
    if (width < 0.5 * available && !isDot) faults.push(`${where}: a line is ${width} of ${available} pixels wide`);
  }
  return faults;
}

function pointer(type, plot, share) {
  const box = plot.getBoundingClientRect();
  plot.dispatchEvent(new PointerEvent(type, {
    clientX: box.left + share * box.width, clientY: box.top + box.height / 2, pointerId: 1, bubbles: true
  }));
}

function viewOf(plot) {
  return Array.from(plot.querySelectorAll('.viewport')).map(part => part.getAttribute('viewBox'));
}

function labelsOf(plot) {
  return Array.from(plot.querySelectorAll('.time-axis text')).map(text => text.textContent);
}

function probePlot(plot, where) {
  const found = {faults: faultsOfTexts(plot, where).concat(faultsOfLines(plot, where))};
  const press = name => plot.closest('.card').querySelector(`button[aria-label="${name}"]`).click();
  const whole = viewOf(plot);
  found.labels = labelsOf(plot);
  found.texts = boxesOfTexts(plot).map(({text}) => text);
  const dotsOf = name => Array.from(plot.querySelectorAll(`.viewport .${name}`))
      .reduce((sum, path) => sum + path.getAttribute('d').split('M').length - 1, 0);
  found.expected = dotsOf('expected');
  found.dots = dotsOf('single');
  pointer('pointermove', plot, 0.5);
  found.values = Array.from(plot.querySelectorAll('.value')).map(value => value.textContent);
  found.clock = plot.closest('.card').querySelector('.clock').textContent;
  found.faults.push(...faultsOfTexts(plot, `${where} with values`));
  press('zoom in');
  press('zoom in');
  if (viewOf(plot).some((view, i) => view === whole[i])) found.faults.push(`${where}: zoom changes nothing`);
  found.zoomed_labels = labelsOf(plot);
  found.faults.push(...faultsOfTexts(plot, `${where} zoomed`));
  press('show the whole plot');
  pointer('pointerdown', plot, 0.25);
  pointer('pointermove', plot, 0.75);
  pointer('pointerup', plot, 0.75);
  found.dragged_labels = labelsOf(plot);
  press('show the whole plot');
  if (viewOf(plot).join() !== whole.join()) found.faults.push(`${where}: the whole plot does not come back`);
  return found;
}

// A picture is empty when few of its points differ from the paper.
async function shareOfInk(source) {
  const image = new Image();
  image.src = source;
  await image.decode();
  const canvas = document.createElement('canvas');
  canvas.width = image.naturalWidth;
  canvas.height = image.naturalHeight;
  const context = canvas.getContext('2d');
  context.drawImage(image, 0, 0);
  const data = context.getImageData(0, 0, canvas.width, canvas.height).data;
  let ink = 0;
  for (let i = 0; i < data.length; i += 4)
    if (data[i] !== data[0] || data[i + 1] !== data[1] || data[i + 2] !== data[2]) ++ink;
  return ink / (data.length / 4);
}

async function probe(widths, pictures) {
  const result = {faults: [], plots: {}, ink: {}};
  const frame = document.querySelector('iframe');
  for (const width of widths) {
    frame.style.width = `${width}px`;
    await new Promise(done => setTimeout(done, 50));
    frame.contentWindow.dispatchEvent(new Event('resize'));
    const page = frame.contentDocument;
    if (page.documentElement.scrollWidth > width)
      result.faults.push(`${width} px: the page is ${page.documentElement.scrollWidth} px wide`);
    const plots = Array.from(page.querySelectorAll('.signal-plot'));
    result.plots[width] = plots.map((plot, i) => probePlot(plot, `${width} px, plot ${i + 1}`));
    for (const plot of result.plots[width]) result.faults.push(...plot.faults);
  }
  for (const [name, source] of Object.entries(pictures)) result.ink[name] = await shareOfInk(source);
  return result;
}
