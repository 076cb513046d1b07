/* An instance of the model as FMI knows it, whichever the version: numbered real variables, modes, events, steps. */
#ifndef WHEELPEND_INSTANCE_H
#define WHEELPEND_INSTANCE_H

#include "wheelpend_fmu.h"
#include "wheelpend_model.h"

#include <stdbool.h>
#include <stddef.h>

#define WP_DRIVEN (WP_INPUTS > 0 ? WP_INPUTS : 1)
#define WP_RESERVES (2 * WP_SURFACES)

/* Value references: the first of each kind. */
enum {
    WP_TIME = 0,
    WP_FIRST_STATE = 1,
    WP_FIRST_SLOPE = WP_FIRST_STATE + WP_ALL_STATES,
    WP_FIRST_INPUT = WP_FIRST_SLOPE + WP_ALL_STATES,
    WP_FIRST_OUTPUT = WP_FIRST_INPUT + WP_DRIVEN,
    WP_FIRST_PARAMETER = WP_FIRST_OUTPUT + WP_OUTPUTS,
    WP_FIRST_COMMAND = WP_FIRST_PARAMETER + WP_PARAMETERS,
    WP_FIRST_DIRECTION = WP_FIRST_COMMAND + WP_COMMANDS * WP_DRIVEN,
    WP_FIRST_RESERVE = WP_FIRST_DIRECTION + WP_SURFACES,
    WP_VARIABLES = WP_FIRST_RESERVE + WP_RESERVES
};

/* In model exchange: created, initialising, then event and continuous in turn. In co-simulation: stepping. */
typedef enum { WP_CREATED, WP_INITIALISING, WP_EVENT, WP_CONTINUOUS, WP_STEPPING, WP_ENDED } wp_phase;

/* All that changes: a copy of it is a saved state. */
typedef struct {
    wp_machine machine;
    wp_real input[WP_DRIVEN];
    wp_real output[WP_OUTPUTS];               /* in co-simulation, of the last step */
    wp_real directions[WP_SURFACES];          /* in model exchange, of each surface with dry friction */
    wp_real command[WP_COMMANDS][WP_DRIVEN];  /* before the start, the newest first */
    wp_real largest_step;                     /* s, of the integrator */
    double time, since, until;                /* s: now, the last and the next event in time */
    wp_phase phase;
    bool steps; /* true in co-simulation */
} wp_instance;

/* As it was created. */
void wp_instance_reset(wp_instance *instance, bool steps);

/* The value of a variable; false where there is none of this number. */
bool wp_instance_get(const wp_instance *instance, unsigned variable, double *value);

/* Set a variable. This and the others below return what is wrong, or NULL. */
const char *wp_instance_set(wp_instance *instance, unsigned variable, double value);

/* The end of initialisation. */
void wp_instance_begin(wp_instance *instance);

/* A point in time of model exchange. */
void wp_instance_set_time(wp_instance *instance, double time);

/* Modes at an event; true where it changed states: what came to rest has no speed any more. */
bool wp_instance_settle(wp_instance *instance);

void wp_instance_slopes(const wp_instance *instance, wp_real slope[WP_ALL_STATES]);
void wp_instance_reserves(const wp_instance *instance, wp_real reserves[WP_RESERVES]);

/* A communication step, in the model's own periods, or in the whole number of equal parts nearest to them. */
const char *wp_instance_step(wp_instance *instance, double from, double length);

/* Derivatives of unknowns along a direction of knowns, as long as no surface changes its mode. */
const char *wp_instance_derivative(const wp_instance *instance, const unsigned unknowns[], size_t count,
                                   const unsigned knowns[], size_t known_count, const double seed[], double found[]);

#endif
