/* Elementary functions by arithmetic alone: no library, no tables, no errno. Relative errors are a few units in the last
   digit of wp_real; each function is copied into an export only where the model needs it. */

/* Absolute value. */
static inline wp_real wp_abs(wp_real x) {
    return x < WP_R(0.0) ? -x : x;
}

/* The smaller of two numbers. */
static inline wp_real wp_min(wp_real a, wp_real b) {
    return b < a ? b : a;
}

/* The larger of two numbers. */
static inline wp_real wp_max(wp_real a, wp_real b) {
    return b > a ? b : a;
}

/* The smaller of two whole numbers. */
static inline int wp_min_int(int a, int b) {
    return b < a ? b : a;
}

/* The larger of two whole numbers. */
static inline int wp_max_int(int a, int b) {
    return b > a ? b : a;
}

/* A number without its fraction; what no int holds is the nearest that it does, and what is no number is 0. */
static inline int wp_whole(wp_real x) {
    if (x >= WP_R(1073741824.0)) {
        return 1073741824;
    }
    if (x <= -WP_R(1073741824.0)) {
        return -1073741824;
    }
    return x == x ? (int)x : 0;
}

/* The least whole number that is not below x, for |x| up to 2^30. */
static inline wp_real wp_ceil(wp_real x) {
    const int whole = wp_whole(x);
    return (wp_real)((wp_real)whole < x ? whole + 1 : whole);
}

/* x to a whole power, from 1 on. */
static inline wp_real wp_power(wp_real x, int n) {
    wp_real product = x;
    for (int i = 1; i < n; i++) {
        product *= x;
    }
    return product;
}

/* Square root: the processor's own instruction where it has one. */
static inline wp_real wp_sqrt(wp_real x) {
    return WP_SQRT(x);
}

/* Sine and cosine. The angle is taken to an eighth of a turn by subtracting quarters in three parts, each so short that
   its multiples are exact; then the series. Past WP_LARGEST_ANGLE whole turns are taken off first, with what
   accuracy is left there. */
static wp_reals2 wp_sine_pair(wp_real x) {
    if (!(wp_abs(x) < WP_LARGEST_ANGLE)) {
        if (!(wp_abs(x) < WP_R(1e9))) {
            x = x - x; /* infinite or none: neither is the result one */
        }
        x -= WP_R(6.283185307179586) * (wp_real)wp_whole(x / WP_R(6.283185307179586));
    }
    const int quarters = wp_whole(x * WP_R(0.6366197723675814) + (x < WP_R(0.0) ? -WP_R(0.5) : WP_R(0.5)));
    const wp_real count = (wp_real)quarters;
    const wp_real rest = ((x - count * WP_QUARTER_1) - count * WP_QUARTER_2) - count * WP_QUARTER_3;
    const wp_real square = rest * rest;
    const wp_real sine = rest + rest * square * (-WP_R(1.66666666666666324348e-01) + square * (
        WP_R(8.33333333332248946124e-03) + square * (-WP_R(1.98412698298579493134e-04) + square * (
        WP_R(2.75573137070700676789e-06) + square * (-WP_R(2.50507602534068634195e-08)
        + square * WP_R(1.58969099521155010221e-10))))));
    const wp_real cosine = WP_R(1.0) - WP_R(0.5) * square + square * square * (WP_R(4.16666666666666019037e-02)
        + square * (-WP_R(1.38888888888741095749e-03) + square * (WP_R(2.48015872894767294178e-05) + square * (
        -WP_R(2.75573143513906633035e-07) + square * (WP_R(2.08757232129817482790e-09)
        - square * WP_R(1.13596475577881948265e-11))))));
    switch (quarters & 3) {
        case 0: return (wp_reals2){{sine, cosine}};
        case 1: return (wp_reals2){{cosine, -sine}};
        case 2: return (wp_reals2){{-sine, -cosine}};
        default: return (wp_reals2){{-cosine, sine}};
    }
}

/* Sine. */
static inline wp_real wp_sin(wp_real x) {
    return wp_sine_pair(x).v[0];
}

/* Cosine. */
static inline wp_real wp_cos(wp_real x) {
    return wp_sine_pair(x).v[1];
}

/* Tangent. */
static inline wp_real wp_tan(wp_real x) {
    const wp_reals2 pair = wp_sine_pair(x);
    return pair.v[0] / pair.v[1];
}

/* 2^n by squaring, for |n| up to WP_LARGEST_EXPONENT + WP_DIGITS. */
static inline wp_real wp_two_to(int n) {
    wp_real factor = n < 0 ? WP_R(0.5) : WP_R(2.0);
    wp_real product = WP_R(1.0);
    for (int left = n < 0 ? -n : n; left > 0; left /= 2) {
        if (left % 2 == 1) {
            product *= factor;
        }
        if (left > 1) {
            factor *= factor;
        }
    }
    return product;
}

/* Exponential function: 2^n times the series of what is left, which is at most half of log 2. Beyond the range of
   wp_real it is 0, or the largest number. */
static wp_real wp_exp(wp_real x) {
    if (x > WP_LARGEST_LOGARITHM) {
        return WP_LARGEST;
    }
    if (x < -WP_LARGEST_LOGARITHM) {
        return WP_R(0.0);
    }
    const int n = wp_whole(x * WP_R(1.4426950408889634) + (x < WP_R(0.0) ? -WP_R(0.5) : WP_R(0.5)));
    const wp_real r = (x - (wp_real)n * WP_LOG2_1) - (wp_real)n * WP_LOG2_2;
    wp_real sum = WP_R(1.0);
    for (int k = 14; k > 0; k--) {
        sum = WP_R(1.0) + sum * r / (wp_real)k;
    }
    const int half = n / 2;
    return sum * wp_two_to(half) * wp_two_to(n - half);
}

/* Natural logarithm: the exponent, and the series of (m - 1) / (m + 1) for what is left, m in 0.707 to 1.414. Of 0 it is
   minus the largest number, of less no number. */
static wp_real wp_log(wp_real x) {
    if (!(x > WP_R(0.0))) {
        return x == WP_R(0.0) ? -WP_LARGEST : (x - x) / (x - x);
    }
    if (x > WP_LARGEST) {
        return x;
    }
    int n = 0;
    for (int step = WP_LARGEST_EXPONENT; step > 0; step /= 2) {
        while (x >= wp_two_to(step) && step > 0) {
            x *= wp_two_to(-step);
            n += step;
        }
        while (x < wp_two_to(-step)) {
            x *= wp_two_to(step);
            n -= step;
        }
    }
    if (x > WP_R(1.4142135623730951)) {
        x *= WP_R(0.5);
        n += 1;
    } else if (x < WP_R(0.7071067811865476)) {
        x *= WP_R(2.0);
        n -= 1;
    }
    const wp_real ratio = (x - WP_R(1.0)) / (x + WP_R(1.0));
    const wp_real square = ratio * ratio;
    wp_real sum = WP_R(0.0);
    for (int k = 23; k > 0; k -= 2) {
        sum = sum * square + WP_R(1.0) / (wp_real)k;
    }
    return (wp_real)n * WP_LOG2_1 + ((wp_real)n * WP_LOG2_2 + WP_R(2.0) * ratio * sum);
}

/* A power whose exponent need not be whole; no number where the base is negative. */
static inline wp_real wp_pow(wp_real x, wp_real y) {
    return x == WP_R(0.0) ? (y > WP_R(0.0) ? WP_R(0.0) : WP_LARGEST) : wp_exp(y * wp_log(x));
}

/* Hyperbolic tangent: near zero by the series of exp(2x) - 1, which does not cancel. */
static wp_real wp_tanh(wp_real x) {
    const wp_real twice = WP_R(2.0) * x;
    if (wp_abs(twice) < WP_R(0.35)) {
        wp_real sum = WP_R(1.0);
        for (int k = 13; k > 1; k--) {
            sum = WP_R(1.0) + sum * twice / (wp_real)k;
        }
        return sum * twice / (sum * twice + WP_R(2.0));
    }
    if (wp_abs(x) > WP_R(22.0)) {
        return x > WP_R(0.0) ? WP_R(1.0) : -WP_R(1.0);
    }
    return WP_R(1.0) - WP_R(2.0) / (wp_exp(twice) + WP_R(1.0));
}

/* Arc tangent: turned by an eighth until the series converges fast. */
static wp_real wp_atan(wp_real x) {
    const wp_real size = wp_abs(x);
    const wp_real eighth = WP_R(0.7853981633974483);
    wp_real begin = WP_R(0.0);
    wp_real rest = size;
    if (size > WP_R(2.414213562373095)) {
        begin = WP_R(2.0) * eighth;
        rest = -WP_R(1.0) / size;
    } else if (size > WP_R(0.41421356237309503)) {
        begin = eighth;
        rest = (size - WP_R(1.0)) / (size + WP_R(1.0));
    }
    const wp_real square = -rest * rest;
    wp_real sum = WP_R(0.0);
    for (int k = 41; k > 0; k -= 2) {
        sum = sum * square + WP_R(1.0) / (wp_real)k;
    }
    const wp_real angle = begin + rest * sum;
    return x < WP_R(0.0) ? -angle : angle;
}

/* True of what is no number. */
static inline bool wp_isnan(wp_real x) {
    return x != x;
}

/* Complementary error function: near zero by its series, further out by its continued fraction. */
static wp_real wp_erfc(wp_real x) {
    const wp_real size = wp_abs(x);
    if (size < WP_R(2.0)) {
        wp_real term = size;
        wp_real sum = size;
        for (int k = 1; k < 50; k++) {
            term *= -size * size / (wp_real)k;
            sum += term / (wp_real)(2 * k + 1);
        }
        const wp_real near = WP_R(1.1283791670955126) * sum;
        return x < WP_R(0.0) ? WP_R(1.0) + near : WP_R(1.0) - near;
    }
    wp_real fraction = size;
    for (int k = 80; k > 0; k--) {
        fraction = size + WP_R(0.5) * (wp_real)k / fraction;
    }
    const wp_real far = WP_R(0.5641895835477563) * wp_exp(-size * size) / fraction;
    return x < WP_R(0.0) ? WP_R(2.0) - far : far;
}
