/* The paper's robot by hand, in C99: what an engineer would write for it without this project.

   States theta_w, theta_p [rad] and their rates [rad/s]; voltages in V; parameters X1...X7 (paper eq. 18). Arrays are in
   row order. */

#include <math.h>

enum { STATES = 4, PARAMETERS = 7, FEATURES = 8 };

/* ---- closed loop */

/* Accelerations of wheel and body (paper eqs. 19, 20). */
static void accelerate(const double *X, double voltage, double angle, double wheel_rate, double body_rate, double *wheel,
                       double *body)
{
    double sine = sin(angle), cosine = cos(angle);
    double drive = voltage - X[5] * wheel_rate + X[6] * body_rate;
    double on_wheel = drive + X[2] * body_rate * body_rate * sine, on_body = X[4] * sine - drive;
    double m11 = X[0] + X[1], m12 = X[2] * cosine - X[1], m22 = X[1] + X[3];
    double scale = 1.0 / (m11 * m22 - m12 * m12);
    *wheel = (m22 * on_wheel - m12 * on_body) * scale;
    *body = (m11 * on_body - m12 * on_wheel) * scale;
}

/* One step of the classical Runge-Kutta method; scalars, because arrays of four would go through memory. */
static void runge_kutta(const double *X, double voltage, double h, double *x)
{
    double half = 0.5 * h, p = x[1], u = x[2], v = x[3];
    double a1, a2, a3, a4, b1, b2, b3, b4;
    accelerate(X, voltage, p, u, v, &a1, &b1);
    double u2 = u + half * a1, v2 = v + half * b1;
    accelerate(X, voltage, p + half * v, u2, v2, &a2, &b2);
    double u3 = u + half * a2, v3 = v + half * b2;
    accelerate(X, voltage, p + half * v2, u3, v3, &a3, &b3);
    double u4 = u + h * a3, v4 = v + h * b3;
    accelerate(X, voltage, p + h * v3, u4, v4, &a4, &b4);
    x[0] += h / 6.0 * (u + 2.0 * (u2 + u3) + u4);
    x[1] += h / 6.0 * (v + 2.0 * (v2 + v3) + v4);
    x[2] += h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4);
    x[3] += h / 6.0 * (b1 + 2.0 * (b2 + b3) + b4);
}

/* The robot under its PID for n samples at t (n,), from a state (4,), which ends as the last; every so many samples
   state and voltage go into a record (rows, 5, stride), at its first place. */
static void drive(long n, const double *t, const double *reference, const double *reference_rate, const double *gains,
                  double *state, const double *X, long every, double *record, long stride)
{
    double x[STATES] = {state[0], state[1], state[2], state[3]}, integral = 0.0;
    long due = 0;
    for (long k = 0; k < n; k++) {
        double error = reference[k] - x[1];
        if (k) integral += error * (t[k] - t[k - 1]);
        double voltage = gains[0] * error + gains[1] * integral + gains[2] * (reference_rate[k] - x[3]);
        if (k == due) {
            for (int i = 0; i < STATES; i++) record[i * stride] = x[i];
            record[STATES * stride] = voltage;
            record += (STATES + 1) * stride;
            due += every;
        }
        if (k + 1 < n) runge_kutta(X, voltage, t[k + 1] - t[k], x);
    }
    for (int i = 0; i < STATES; i++) state[i] = x[i];
}

/* count robots one after the other: gains (count, 3), states (count, 4), parameters (count, 7), record (rows, 5, count). */
void closed_loop(long n, const double *t, const double *reference, const double *reference_rate, long count,
                 const double *gains, double *states, const double *parameters, long every, double *record)
{
    for (long b = 0; b < count; b++)
        drive(n, t, reference, reference_rate, gains + 3 * b, states + STATES * b, parameters + PARAMETERS * b, every,
              record + b, count);
}

/* ---- filtered regression (paper eqs. 25-43) */

/* Columns of the regressor, and last the left side, as sums of the features: wheel row, then body row. Features, all
   behind the filters: a = ddtheta_w, b = ddtheta_p, c = (cos theta_p dtheta_p)', d = X3's column in the body's row,
   e = sin theta_p, f = dtheta_w, g = dtheta_p, v = voltage. */
static const signed char ROWS[2][PARAMETERS + 1][FEATURES] = {
    {{1}, {1, -1}, {0, 0, 1}, {0}, {0}, {0, 0, 0, 0, 0, 1}, {0, 0, 0, 0, 0, 0, -1}, {0, 0, 0, 0, 0, 0, 0, 1}},
    {{0}, {1, -1}, {0, 0, 0, 1}, {0, -1}, {0, 0, 0, 0, 1}, {0, 0, 0, 0, 0, 1}, {0, 0, 0, 0, 0, 0, -1},
     {0, 0, 0, 0, 0, 0, 0, 1}},
};

/* Exact step of z1' = (u - z1)/tau1, z2' = (z1 - z2)/tau2 for u linear between samples. */
struct weights {
    double decay1, decay2, coupling, old1, new1, old2, new2, old_alone, new_alone; /* alone: z2 driven directly */
};

static struct weights weights_of(double h, double tau1, double tau2)
{
    double e1 = exp(-h / tau1), e2 = exp(-h / tau2), apart = tau1 - tau2;
    double new1 = 1.0 - tau1 / h * (1.0 - e1), new_alone = 1.0 - tau2 / h * (1.0 - e2);
    double new2 = (tau1 * new1 - tau2 * new_alone) / apart;
    return (struct weights){
        .decay1 = e1,
        .decay2 = e2,
        .coupling = tau1 / apart * (e1 - e2),
        .old1 = 1.0 - e1 - new1,
        .new1 = new1,
        .old2 = (tau1 * (1.0 - e1) - tau2 * (1.0 - e2)) / apart - new2,
        .new2 = new2,
        .old_alone = 1.0 - e2 - new_alone,
        .new_alone = new_alone,
    };
}

struct filter {
    double z1, z2;
};

static inline void advance(struct filter *z, const struct weights *w, double old, double new)
{
    z->z2 = w->decay2 * z->z2 + w->coupling * z->z1 + w->old2 * old + w->new2 * new;
    z->z1 = w->decay1 * z->z1 + w->old1 * old + w->new1 * new;
}

/* Gram matrix (8, 8) of regressor and left side, both rows together, behind 1/((tau1 s + 1)(tau2 s + 1)), of a log that
   begins at rest: states (n, 4), voltage (n,), one sample every h [s]. Signals are linear between samples, the voltage
   constant; the wheel's rate is the increment of its angle. The rates of the filters' outputs stand for derivatives. */
void filtered_gram(long n, double h, const double *states, const double *voltage, double tau1, double tau2, double *gram)
{
    const struct weights w = weights_of(h, tau1, tau2);
    double sum[FEATURES][FEATURES] = {{0.0}}, faster = 1.0 / tau1, slower = 1.0 / tau2;
    double sine = sin(states[1]), cosine = cos(states[1]);
    struct filter wheel = {states[0], states[0]}, pitch = {states[1], states[1]};
    struct filter gravity = {0.0, 0.0}, swing = {0.0, 0.0}, body = {0.0, 0.0}, drive = {0.0, 0.0};

    for (long k = 1; k < n; k++) {
        const double *old = states + STATES * (k - 1), *new = old + STATES;
        double old_sine = sine, old_cosine = cosine;
        sine = sin(new[1]);
        cosine = cos(new[1]);
        double wheel_speed = (new[0] - old[0]) / h;
        /* -(cos theta_p dtheta_w)' - sin theta_p dtheta_p dtheta_w in one filter: the first drives its second stage too */
        double old_direct = -old_cosine * wheel_speed * faster, new_direct = -cosine * wheel_speed * faster;
        advance(&wheel, &w, old[0], new[0]);
        advance(&pitch, &w, old[1], new[1]);
        advance(&gravity, &w, old_sine, sine);
        advance(&swing, &w, old_cosine * old[3], cosine * new[3]);
        advance(&body, &w, -old_sine * old[3] * wheel_speed - old_direct, -sine * new[3] * wheel_speed - new_direct);
        body.z2 += w.old_alone * old_direct + w.new_alone * new_direct;
        advance(&drive, &w, voltage[k - 1], voltage[k - 1]);

        double f = (wheel.z1 - wheel.z2) * slower, g = (pitch.z1 - pitch.z2) * slower;
        double a = ((new[0] - wheel.z1) * faster - f) * slower, b = ((new[1] - pitch.z1) * faster - g) * slower;
        double c = (swing.z1 - swing.z2) * slower, d = body.z2, e = gravity.z2, v = drive.z2;
        /* written out, because a loop over an array of features goes through memory and takes half as long again */
        sum[0][0] += a * a; sum[0][1] += a * b; sum[0][2] += a * c; sum[0][3] += a * d; sum[0][4] += a * e;
        sum[0][5] += a * f; sum[0][6] += a * g; sum[0][7] += a * v;
        sum[1][1] += b * b; sum[1][2] += b * c; sum[1][3] += b * d; sum[1][4] += b * e; sum[1][5] += b * f;
        sum[1][6] += b * g; sum[1][7] += b * v;
        sum[2][2] += c * c; sum[2][5] += c * f; sum[2][6] += c * g; sum[2][7] += c * v;
        sum[3][3] += d * d; sum[3][4] += d * e; sum[3][5] += d * f; sum[3][6] += d * g; sum[3][7] += d * v;
        sum[4][4] += e * e; sum[4][5] += e * f; sum[4][6] += e * g; sum[4][7] += e * v;
        sum[5][5] += f * f; sum[5][6] += f * g; sum[5][7] += f * v;
        sum[6][6] += g * g; sum[6][7] += g * v;
        sum[7][7] += v * v;
    }
    for (int i = 0; i < FEATURES; i++)
        for (int j = 0; j < i; j++) sum[i][j] = sum[j][i];

    for (int a = 0; a <= PARAMETERS; a++)
        for (int b = 0; b <= PARAMETERS; b++) {
            double total = 0.0;
            for (int row = 0; row < 2; row++)
                for (int i = 0; i < FEATURES; i++)
                    for (int j = 0; j < FEATURES; j++) total += ROWS[row][a][i] * ROWS[row][b][j] * sum[i][j];
            gram[a * (PARAMETERS + 1) + b] = total;
        }
}

/* Sum of n numbers: as fast as they can be read. */
double total(long n, const double *x)
{
    enum { LANES = 32 };
    double sums[LANES] = {0.0}, sum = 0.0;
    long k = 0;
    for (; k + LANES <= n; k += LANES)
        for (int i = 0; i < LANES; i++) sums[i] += x[k + i];
    for (; k < n; k++) sum += x[k];
    for (int i = 0; i < LANES; i++) sum += sums[i];
    return sum;
}

/* ---- recursive least squares */

/* One update with a row phi (n,) and its left side tau: estimate (n,), covariance (n, n). */
static void update(double *estimate, double *covariance, const double *phi, double tau, double forgetting)
{
    enum { n = PARAMETERS };
    double spread_along[n], spread = forgetting, error = tau;
    for (int i = 0; i < n; i++) {
        spread_along[i] = 0.0;
        for (int j = 0; j < n; j++) spread_along[i] += covariance[i * n + j] * phi[j];
        spread += phi[i] * spread_along[i];
        error -= phi[i] * estimate[i];
    }
    double scale = 1.0 / spread, less = 1.0 / forgetting;
    for (int i = 0; i < n; i++) {
        double gain = spread_along[i] * scale;
        estimate[i] += gain * error;
        for (int j = 0; j <= i; j++) {
            covariance[i * n + j] = (covariance[i * n + j] - gain * spread_along[j]) * less;
            covariance[j * n + i] = covariance[i * n + j];
        }
    }
}

void recursive(long rows, const double *phi, const double *tau, double forgetting, double *estimate, double *covariance)
{
    for (long k = 0; k < rows; k++) update(estimate, covariance, phi + PARAMETERS * k, tau[k], forgetting);
}
