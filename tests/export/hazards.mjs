// What a page or a robot's script meets: readings that are no numbers, glitches, a filter that is wrong itself.
const model = await import(process.argv[2]);
const machine = new model.Machine();
const filters = { observer: new model.Observer(), identifier: new model.Identifier() };
let output = machine.start([0, 0.02, 0, 0]).slice();
for (const filter of Object.values(filters)) {
    filter.start([0, 0.02, 0, 0]);
}

/** Samples under a controller of the true state, with something added to a reading. */
function run(filter, samples, channel = 0, added = 0) {
    let taken = [1, 1, 1];
    for (let k = 0; k < samples; k++) {
        const measured = output.slice();
        measured[channel] += added;
        filter.update(measured);
        taken = taken.map((all, y) => Math.min(all, filter.taken[y]));
        const command = 168 * machine.now[1] + 18 * machine.now[3];
        filter.predict(command);
        output = machine.step(command).slice();
    }
    const off = Math.max(...[0, 1, 2, 3].map((i) => Math.abs(filter.now[i] - machine.now[i])));
    return { taken, off, healthy: filter.healthy };
}

const found = {};
for (const [name, filter] of Object.entries(filters)) {
    filter.start(machine.now.slice(0, 4));
    const seen = (found[name] = {});
    seen.plain = run(filter, 500);
    seen.none = run(filter, 1, 0, NaN);
    seen.infinite = run(filter, 1, 1, Infinity);
    seen.glitch = run(filter, 1, 2, -30);
    seen.after = run(filter, 50);
    filter.now[0] += 1;
    seen.lost = run(filter, 10);
    seen.believed = run(filter, 6);
    seen.settled = run(filter, 3000);
    filter.now[0] = NaN;
    seen.sick = { healthy: filter.healthy };
    filter.start(machine.now.slice(0, 4));
    seen.anew = run(filter, 50);
}
process.stdout.write(JSON.stringify(found));
