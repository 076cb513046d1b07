
{ // follows the text of the model, whose Machine, VALUES and replayedSegments it uses
const carried = JSON.parse(document.querySelector("script[data-sliders=numbers]").textContent);
const section = document.getElementById("try");
const channels = OUTPUTS.length;

function wholeNumbers(text) {
    const found = [];
    let value = 0, place = 1;
    for (const c of atob(text)) {
        const byte = c.charCodeAt(0);
        value += (byte & 127) * place;
        place *= 128;
        if (byte < 128) {
            found.push(value % 2 ? -(value + 1) / 2 : value / 2);
            value = 0;
            place = 1;
        }
    }
    return found;
}

function sums(numbers) {
    let sum = 0;
    return numbers.map((n) => sum += n);
}

const held = ([text, quantum]) => wholeNumbers(text).map((n) => n * quantum);
const smooth = ([text, quantum]) => sums(sums(wholeNumbers(text))).map((n) => n * quantum);
const commands = carried.commands.map(held);
const intervals = carried.intervals && held(carried.intervals);
const measured = carried.measured.map(smooth);
const counted = carried.counted.map((text) => wholeNumbers(text).flatMap((n, k) => Array(n).fill(k % 2 === 0)));
const drawn = sums(wholeNumbers(carried.drawn)); // −1 breaks the line
const times = [];
let first = 0;
const segments = carried.segments.map((segment) => {
    const range = Array.from({length: segment.steps}, (_, k) => first + k);
    first += segment.steps;
    const own = range.map((k) => intervals ? intervals[k] : carried.interval);
    times.push(segment.time, ...sums(own).map((t) => t + segment.time));
    return {...segment, intervals: own, commands: range.flatMap((k) => commands.map((c) => c[k]))};
});

const machine = new Machine();
function simulated(parameters) {
    machine.parameters.set(parameters);
    machine.now.fill(0);
    return replayedSegments(machine, segments);
}

function errorOf(readings) {
    let squares = 0;
    for (let c = 0; c < channels; c++) {
        for (let k = 0; k < measured[c].length; k++) {
            if (counted[c][k]) squares += ((measured[c][k] - readings[channels * k + c]) / carried.sigma[c]) ** 2;
        }
    }
    return Math.sqrt(squares / Math.max(carried.freedom, 1));
}

function digits(value, count) {
    const text = Math.abs(value) >= 1e6 || (value && Math.abs(value) < 1e-4) ? value.toExponential(count - 1)
        : Math.abs(value) >= 10 ** count ? value.toFixed(0) : value.toPrecision(count);
    return text.replaceAll("-", "−");
}
const errorText = (error) => error < 1e6 ? `${digits(error, 3)} σ` : error < Infinity ? "over 10⁶ σ" : "it runs away";

const chart = document.getElementById("try-chart");
const figure = unpacked(document.querySelector("script[data-sliders=figure]").textContent);
function lines(readings) {
    const pick = (values) => drawn.map((k) => k < 0 || !Number.isFinite(values(k)) ? null : values(k));
    const found = [];
    for (let c = 0; c < channels; c++) {
        const rest = (k) => counted[c][k] ? (measured[c][k] - readings[channels * k + c]) / carried.sigma[c] : NaN;
        found.push(pick((k) => counted[c][k] ? measured[c][k] : NaN), pick((k) => readings[channels * k + c]), pick(rest));
    }
    return found;
}

const sliders = [...section.querySelectorAll("input[type=range]")];
const switches = [...section.querySelectorAll("input[type=checkbox]")];
const known = carried.groups.flat();
const shownError = document.getElementById("try-error");
const spent = document.getElementById("try-time");
const valueOf = (k) => known[k].value + known[k].scale * (Number(sliders[k].value) / known[k].steps);
const isOff = (k) => sliders[k].closest("fieldset").querySelector("input[type=checkbox]")?.checked ?? false;

let asked = false;
function show() {
    asked = false;
    const parameters = Float64Array.from(carried.parameters);
    sliders.forEach((slider, k) => {
        const unit = known[k].unit && ` ${known[k].unit}`;
        slider.disabled = isOff(k);
        parameters[known[k].place] = isOff(k) ? Number(known[k].absent) : valueOf(k);
        const text = isOff(k) ? "absent" : digits(valueOf(k), 4) + unit;
        slider.setAttribute("aria-valuetext", text);
        document.getElementById(slider.id + "-value").textContent = text;
    });
    const begun = performance.now();
    const readings = simulated(parameters);
    const error = errorOf(readings);
    const took = performance.now() - begun;
    shownError.textContent = errorText(error);
    spent.textContent = `${took.toFixed(0)} ms`;
    section.dataset.simulations = Number(section.dataset.simulations ?? 0) + 1;
    const y = lines(readings);
    if (chart.data) {
        Plotly.restyle(chart, {y});
    } else {
        const x = drawn.map((k) => k < 0 ? null : times[k]);
        figure.data.forEach((trace, k) => Object.assign(trace, {x, y: y[k]}));
        Plotly.newPlot(chart, figure.data, figure.layout, {responsive: true, displaylogo: false, displayModeBar: false});
    }
}

function ask() {
    if (!asked) setTimeout(show);
    asked = true;
}

for (const input of [...sliders, ...switches]) input.addEventListener("input", ask);
document.getElementById("try-back").addEventListener("click", () => {
    for (const slider of sliders) slider.value = 0;
    for (const box of switches) box.checked = false;
    ask();
});
for (const slider of sliders) slider.value = 0;
for (const box of switches) box.checked = false;
section.hidden = false;
show();
}
