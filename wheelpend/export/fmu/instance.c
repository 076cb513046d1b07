/* An instance of the model as FMI knows it. */
#include "instance.h"

#include <math.h>
#include <string.h>

#if WP_INPUTS > 1
#define WP_GIVEN(values) (values)
#else
#define WP_GIVEN(values) (values)[0]
#endif

#define WP_AT_EVENT 1e-9 /* s, within which a moment is that of an event */
#define WP_SHARE 1e-3    /* of a variable, by which differences move it */
#define WP_UNKNOWN_MODE 2.0

void wp_instance_reset(wp_instance *instance, bool steps) {
    memset(instance, 0, sizeof *instance);
    wp_machine_init(&instance->machine);
    instance->largest_step = instance->machine.max_step;
    instance->steps = steps;
    instance->phase = WP_CREATED;
    instance->since = -HUGE_VAL;
    instance->until = HUGE_VAL;
    for (int i = 0; i < WP_SURFACES; i++) {
        instance->directions[i] = WP_UNKNOWN_MODE;
    }
}

/* The modes of the surfaces: those that events left, else as the state has them. */
static void modes(const wp_instance *instance, wp_real directions[WP_SURFACES]) {
    memcpy(directions, instance->directions, sizeof instance->directions);
    if (directions[0] >= WP_UNKNOWN_MODE) {
        wp_machine machine = instance->machine;
        wp_machine_settle(&machine, WP_GIVEN(instance->input), directions);
    }
}

void wp_instance_slopes(const wp_instance *instance, wp_real slope[WP_ALL_STATES]) {
    wp_real directions[WP_SURFACES];
    modes(instance, directions);
    wp_machine_slopes(&instance->machine, WP_GIVEN(instance->input), directions, slope);
}

void wp_instance_reserves(const wp_instance *instance, wp_real reserves[WP_RESERVES]) {
    wp_real directions[WP_SURFACES];
    modes(instance, directions);
    wp_machine_reserves(&instance->machine, WP_GIVEN(instance->input), directions, reserves);
}

bool wp_instance_get(const wp_instance *instance, unsigned variable, double *value) {
    const int place = variable < WP_VARIABLES ? (int)variable : WP_VARIABLES;
    wp_real found[WP_ALL_STATES + WP_OUTPUTS + WP_RESERVES] = {0.0};
    if (place == WP_TIME) {
        *value = instance->time;
    } else if (place < WP_FIRST_SLOPE) {
        *value = instance->machine.now[place - WP_FIRST_STATE];
    } else if (place < WP_FIRST_INPUT) {
        wp_instance_slopes(instance, found);
        *value = found[place - WP_FIRST_SLOPE];
    } else if (place < WP_FIRST_OUTPUT) {
        *value = instance->input[place - WP_FIRST_INPUT];
    } else if (place < WP_FIRST_PARAMETER) {
        wp_machine_read(&instance->machine, found);
        *value = (instance->phase == WP_STEPPING ? instance->output : found)[place - WP_FIRST_OUTPUT];
    } else if (place < WP_FIRST_COMMAND) {
        *value = instance->machine.parameters[place - WP_FIRST_PARAMETER];
    } else if (place < WP_FIRST_DIRECTION) {
        *value = instance->command[(place - WP_FIRST_COMMAND) / WP_DRIVEN][(place - WP_FIRST_COMMAND) % WP_DRIVEN];
    } else if (place < WP_FIRST_RESERVE) {
        modes(instance, found);
        *value = found[place - WP_FIRST_DIRECTION];
    } else if (place < WP_VARIABLES) {
        wp_instance_reserves(instance, found);
        *value = found[place - WP_FIRST_RESERVE];
    }
    return place < WP_VARIABLES;
}

/* A variable that can be set, or NULL. */
static wp_real *settable(wp_instance *instance, int place) {
    if (place >= WP_FIRST_STATE && place < WP_FIRST_SLOPE) {
        return &instance->machine.now[place - WP_FIRST_STATE];
    }
    if (place >= WP_FIRST_INPUT && place < WP_FIRST_OUTPUT) {
        return &instance->input[place - WP_FIRST_INPUT];
    }
    if (place >= WP_FIRST_PARAMETER && place < WP_FIRST_COMMAND) {
        return &instance->machine.parameters[place - WP_FIRST_PARAMETER];
    }
    if (place >= WP_FIRST_COMMAND && place < WP_FIRST_DIRECTION) {
        return &instance->command[(place - WP_FIRST_COMMAND) / WP_DRIVEN][(place - WP_FIRST_COMMAND) % WP_DRIVEN];
    }
    return NULL;
}

const char *wp_instance_set(wp_instance *instance, unsigned variable, double value) {
    const int place = variable < WP_VARIABLES ? (int)variable : WP_VARIABLES;
    wp_real *target = settable(instance, place);
    const bool tunable = (place >= WP_FIRST_INPUT && place < WP_FIRST_OUTPUT) ||
                         (place >= WP_FIRST_PARAMETER && place < WP_FIRST_COMMAND);
    if (!target) {
        return "Only inputs, parameters and start values can be set, and this variable is none of them.";
    }
    if (!isfinite(value)) {
        return "A value must be a finite number, and the one that came is none.";
    }
    if (!tunable && instance->phase > WP_INITIALISING) {
        return "A start value can be set before the initialisation ends, and no later.";
    }
    *target = value;
    return NULL;
}

/* The time at which the model is evaluated: at an event in time on the side on which the solver is. */
static double moment(const wp_instance *instance) {
    if (instance->time > instance->until - WP_AT_EVENT) {
        return instance->until - WP_AT_EVENT;
    }
    return instance->time < instance->since + WP_AT_EVENT ? instance->since + WP_AT_EVENT : instance->time;
}

void wp_instance_set_time(wp_instance *instance, double time) {
    instance->time = time;
    instance->machine.time = moment(instance);
}

bool wp_instance_settle(wp_instance *instance) {
    static const int events[] = WP_EVENT_TIMES;
    wp_real before[WP_ALL_STATES];
    memcpy(before, instance->machine.now, sizeof before);
    instance->until = HUGE_VAL;
    for (int i = 0; i < WP_EVENTS; i++) {
        const double event = instance->machine.parameters[events[i]];
        if (event > instance->time + WP_AT_EVENT && event < instance->until) {
            instance->until = event;
        } else if (fabs(event - instance->time) <= WP_AT_EVENT) {
            instance->since = event;
        }
    }
    instance->machine.time = moment(instance);
    wp_machine_settle(&instance->machine, WP_GIVEN(instance->input), instance->directions);
    return memcmp(before, instance->machine.now, sizeof before) != 0;
}

void wp_instance_begin(wp_instance *instance) {
    const wp_machine given = instance->machine;
    wp_machine_start(&instance->machine, given.now, WP_GIVEN(instance->command[0]));
    memcpy(instance->machine.now, given.now, sizeof given.now);
    memcpy(instance->machine.parameters, given.parameters, sizeof given.parameters);
    instance->machine.time = instance->time;
    memcpy(instance->machine.commands, instance->command, sizeof instance->command);
    for (int j = 0; j < WP_LATE_READINGS; j++) {
        wp_machine_read(&instance->machine, instance->machine.readings[j]);
    }
    wp_machine_read(&instance->machine, instance->output);
    if (instance->steps) {
        instance->phase = WP_STEPPING;
    } else {
        instance->phase = WP_EVENT;
        (void)wp_instance_settle(instance);
    }
}

/* True where fewer samples are kept than a delay among the parameters spans in steps of this length [s]. */
static bool is_cut(const wp_instance *instance, int place, double step, int kept) {
    return place >= 0 && instance->machine.parameters[place] / step > (double)(kept - 1);
}

const char *wp_instance_step(wp_instance *instance, double from, double length) {
    const double parts = floor(length / WP_PERIOD + 0.5);
    if (!(length > 0.0) || !(parts < 1e9)) {
        return "A communication step must be above zero and below a thousand million of the model's periods.";
    }
    if (!(fabs(from - instance->time) <= 1e-6 * (1.0 + fabs(from)))) {
        return "A step must begin where the last one ended.";
    }
    const int count = parts < 1.0 ? 1 : (int)parts;
    wp_machine *machine = &instance->machine;
    machine->period = length / count;
    machine->max_step = machine->period < instance->largest_step ? machine->period : instance->largest_step;
    if (is_cut(instance, WP_DELAY, machine->period, WP_COMMANDS) ||
        is_cut(instance, WP_SENSOR_DELAY, machine->period, WP_LATE_READINGS)) {
        return "A delay spans more samples than are kept: take longer communication steps, or export with a larger delay.";
    }
    machine->time = from;
    for (int i = 0; i < count; i++) {
        wp_machine_step(machine, WP_GIVEN(instance->input), instance->output);
    }
    instance->time = machine->time = from + length;
    for (int i = 0; i < WP_ALL_STATES; i++) {
        if (!isfinite(machine->now[i])) {
            return "The state is no finite number any more: the machine has run away.";
        }
    }
    return NULL;
}

const char *wp_instance_derivative(const wp_instance *instance, const unsigned unknowns[], size_t count,
                                   const unsigned knowns[], size_t known_count, const double seed[], double found[]) {
    static const double weights[] = {1.0, -8.0, 8.0, -1.0}, offsets[] = {-2.0, -1.0, 1.0, 2.0};
    wp_instance held = *instance;
    double share = 0.0, value = 0.0;
    modes(instance, held.directions);
    memset(found, 0, count * sizeof *found);
    for (size_t k = 0; k < known_count; k++) {
        const bool is_parameter = knowns[k] >= (unsigned)WP_FIRST_PARAMETER && knowns[k] < (unsigned)WP_FIRST_COMMAND;
        if (knowns[k] >= (unsigned)WP_VARIABLES || !settable(&held, (int)knowns[k])) {
            return "A derivative is known along states, inputs and parameters, and this variable is none of them.";
        }
        (void)wp_instance_get(instance, knowns[k], &value);
        share = fmax(share, fabs(seed[k]) / (is_parameter && value != 0.0 ? fabs(value) : 1.0));
    }
    if (!(share > 0.0) || !isfinite(share)) {
        return share == 0.0 ? NULL : "A seed must be a finite number, and the one that came is none.";
    }
    for (int point = 0; point < 4; point++) {
        wp_instance moved = held;
        for (size_t k = 0; k < known_count; k++) {
            *settable(&moved, (int)knowns[k]) += offsets[point] * WP_SHARE / share * seed[k];
        }
        for (size_t u = 0; u < count; u++) {
            if (!wp_instance_get(&moved, unknowns[u], &value)) {
                return "There is no variable of this number.";
            }
            found[u] += weights[point] * value * share / (12.0 * WP_SHARE);
        }
    }
    return NULL;
}
