#include "runtime/report/html/plot_script.hpp"

namespace hil::report {

std::string_view plot_script() {
  return R"js(
(function () {
  'use strict';
  var SVG = 'http://www.w3.org/2000/svg';
  // A longer range of values does not fit beside a name on a phone; its middle is shown.
  var maxRangeCharacters = 16;

  // The values of a path: at x the vertical range low to high, which lasts up to end.
  function valuesOf(path) {
    var list = [], x = 0, y = 0, last = null;
    path.getAttribute('d').replace(/([Mlhv])([^Mlhv]*)/g, function (whole, code, rest) {
      var n = rest.trim().split(' ').map(Number);
      if (code === 'h') {
        x += n[0];
        last.end = x;
      } else if (code === 'v') {
        y += n[0];
        last.low = Math.max(last.low, y);
        last.high = Math.min(last.high, y);
      } else {
        x = code === 'M' ? n[0] : x + n[0];
        y = code === 'M' ? n[1] : y + n[1];
        if (last !== null) { if (code === 'l') last.end = x; }
        last = {x: x, low: y, high: y, end: x};
        list.push(last);
      }
    });
    return list;
  }

  function valueAt(list, x) {
    var low = 0, high = list.length;
    while (high > low) {
      var middle = (low + high) >> 1;
      if (list[middle].x > x) high = middle; else low = middle + 1;
    }
    if (low === 0) return null;
    return list[low - 1].end >= x ? list[low - 1] : null;
  }

  function number(value, digits) {
    return String(Number(value.toPrecision(digits)));
  }

  function curveOf(path, height) {
    var low = Number(path.dataset.low), high = Number(path.dataset.high);
    var steps = path.dataset.steps === '1';
    var names = JSON.parse(path.dataset.names);
    // The text of a value shows a thousandth of the axis, also where its values are far from 0.
    var farthest = Math.max(Math.abs(low), Math.abs(high));
    var digits = Math.min(12, Math.max(4, 3 + Math.ceil(Math.log10(farthest / (high - low)))));
    function text(y) {
      var value = high - y / height * (high - low);
      if (!steps) return number(value, digits);
      value = Math.round(value);
      var named = names.find(function (pair) { return pair[0] === value; });
      return named ? named[1] : String(value);
    }
    var values = null;
    return function (x) {
      values = values || valuesOf(path);
      var value = valueAt(values, x);
      if (value === null) return '\u2013';
      // A range that is narrower than the line is one value.
      if (!steps) { if (height / 500 > value.low - value.high) return text((value.low + value.high) / 2); }
      var from = text(value.low), to = text(value.high);
      if (from === to) return from;
      var range = from + ' \u2026 ' + to;
      return steps || maxRangeCharacters >= range.length ? range : '\u2248 ' + text((value.low + value.high) / 2);
    };
  }

  function timeStep(length, count) {
    var power = Math.pow(10, Math.floor(Math.log10(length / count)));
    return [1, 2, 5, 10].map(function (m) { return m * power; })
        .find(function (step) { return step * count >= length; });
  }

  function decimalsOf(step) {
    return Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  }

  function setUp(plot) {
    var height = Number(plot.dataset.height);
    var whole = Number(plot.dataset.width);
    var begin = Number(plot.dataset.begin) / 1e9, column = Number(plot.dataset.column) / 1e9;
    var viewports = Array.from(plot.querySelectorAll('.viewport'));
    var curves = Array.from(plot.querySelectorAll('.viewport path[data-names]')).map(function (path) {
      return curveOf(path, height);
    });
    var values = Array.from(plot.querySelectorAll('.value'));
    var axis = plot.querySelector('.time-axis');
    var from = 0, to = whole, pressed = null;

    function addLine(name) {
      return viewports.map(function (part) {
        var line = document.createElementNS(SVG, 'path');
        line.setAttribute('class', name);
        part.appendChild(line);
        return line;
      });
    }
    var cursors = addLine('cursor'), selections = addLine('selection');

    function drawAxis() {
      var length = (to - from) * column, first = begin + from * column;
      var step = timeStep(length, Math.max(2, Math.floor(plot.getBoundingClientRect().width / 90)));
      axis.replaceChildren();
      for (var k = Math.ceil(first / step - 1e-9); first + length + step * 1e-9 >= k * step; ++k) {
        var label = document.createElementNS(SVG, 'text');
        label.setAttribute('x', 100 * (k * step - first) / length + '%');
        label.setAttribute('y', Number(axis.dataset.y) + 4);
        label.setAttribute('text-anchor', 'middle');
        label.textContent = (k * step).toFixed(decimalsOf(step)) + ' s';
        axis.appendChild(label);
      }
    }

    function show(a, b) {
      var length = Math.min(whole, Math.max(b - a, Math.min(whole, 4)));
      from = Math.min(Math.max(0, (a + b - length) / 2), whole - length);
      to = from + length;
      viewports.forEach(function (part) {
        part.setAttribute('viewBox', from + ' 0 ' + length + ' ' + height);
      });
      drawAxis();
    }

    function xOf(event) {
      var box = plot.getBoundingClientRect();
      var share = (event.clientX - box.left) / box.width;
      return from + Math.min(1, Math.max(0, share)) * (to - from);
    }

    function point(event) {
      var x = xOf(event), time = begin + x * column;
      cursors.forEach(function (line) { line.setAttribute('d', 'M' + x + ' 0v' + height); });
      curves.forEach(function (curve, i) { values[i].textContent = curve(x); });
      clock.textContent = time.toFixed(decimalsOf((to - from) * column / 1000)) + ' s';
      if (pressed !== null)
        selections.forEach(function (line) {
          line.setAttribute('d', 'M' + pressed + ' 0H' + x + 'V' + height + 'H' + pressed + 'Z');
        });
    }

    function release() {
      pressed = null;
      selections.forEach(function (line) { line.removeAttribute('d'); });
    }

    var tools = document.createElement('div');
    tools.className = 'tools';
    function button(text, name, action) {
      var element = document.createElement('button');
      element.type = 'button';
      element.textContent = text;
      element.setAttribute('aria-label', name);
      element.addEventListener('click', action);
      tools.appendChild(element);
    }
    function scaled(factor) {
      return function () {
        var middle = (from + to) / 2, half = (to - from) / 2 * factor;
        show(middle - half, middle + half);
      };
    }
    function moved(share) {
      return function () {
        var shift = Math.max(-from, Math.min(whole - to, (to - from) * share));
        show(from + shift, to + shift);
      };
    }
    var clock = document.createElement('span');
    clock.className = 'clock';
    tools.appendChild(clock);
    button('\u2190', 'earlier', moved(-0.5));
    button('\u2192', 'later', moved(0.5));
    button('+', 'zoom in', scaled(0.5));
    button('\u2212', 'zoom out', scaled(2));
    button('whole', 'show the whole plot', function () { show(0, whole); });
    plot.parentNode.insertBefore(tools, plot);

    plot.addEventListener('pointermove', point);
    plot.addEventListener('pointerleave', function () {
      if (pressed !== null) return;
      cursors.forEach(function (line) { line.removeAttribute('d'); });
      values.forEach(function (value) { value.textContent = ''; });
      clock.textContent = '';
    });
    plot.addEventListener('pointerdown', function (event) {
      if (event.button !== 0) return;
      pressed = xOf(event);
      plot.setPointerCapture(event.pointerId);
    });
    plot.addEventListener('pointerup', function (event) {
      if (pressed === null) return;
      var x = xOf(event), began = pressed;
      release();
      if (Math.abs(x - began) > (to - from) / 50) show(Math.min(x, began), Math.max(x, began));
    });
    plot.addEventListener('pointercancel', release);
    plot.addEventListener('dblclick', function () { show(0, whole); });
    window.addEventListener('resize', drawAxis);
    drawAxis();
  }

  document.documentElement.classList.add('scripted');
  document.querySelectorAll('.signal-plot').forEach(setUp);
}());
)js";
}

}  // namespace hil::report
