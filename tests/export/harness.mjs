// All parts of an export in one loop, as harness.c has them.
import { readFileSync } from "node:fs";
const model = await import(process.argv[2]);
const commands = readFileSync(0, "utf8").trim().split(/\s+/).map(Number);
const shown = [];
const machine = new model.Machine();
const observer = new model.Observer();
const identifier = new model.Identifier();
const inputs = Math.max(model.INPUTS.length, 1);
const given = (value) => (inputs > 1 ? new Float64Array(inputs).fill(value) : value);
const state = new Float64Array(model.STATES.length);
state[0] = 0.01;
state[state.length - 1] = 0.05;
machine.start(state, given(0));
observer.start(state, given(0));
identifier.start(state, given(0));
let output = machine.read();
let command = 0;
for (const wanted of commands) {
    observer.update(output);
    identifier.update(output);
    command = wanted;
    if (model.compensate) {
        command = model.compensate(wanted, observer.now);
        shown.push(command);
    }
    shown.push(...machine.rates(given(command)));
    observer.predict(given(command));
    identifier.predict(given(command));
    output = machine.step(given(command));
    shown.push(...machine.now, ...output, ...observer.now, ...observer.force, ...observer.innovation);
    shown.push(...model.LEARNT.map((place) => identifier.parameters[place]));
}
const last = machine.linearise(given(command));
shown.push(...last.a, ...last.b, ...last.c);
process.stdout.write(shown.join("\n"));
