"""Parameter estimation: maximum-likelihood fits of a model to logs, by multiple shooting and by filter-error.

In: a model and its logs. Out: `Fit`, with covariances, and the error on validation data. Question: which parameter
values make the measurements likeliest, and how well do they predict what the fit has not seen?

    data, segments          logs read, their noise estimated, cut into estimation and validation segments
    held_out_motion         what is held out and hardly judges what is fitted
    restrictions            values and bounds of single parameters that a user gives
    problem                 the estimation problem: model, kernels, segments; which effects can be tested on it
    criteria                error thresholds that decide how a fit is taken
    free_parameters         names, bounds, scopes and known values of free parameters
    parameters              the parameter vector of a kernel module, and the layout of free parameters over logs
    parameter_space         the vector θ of a fit: its start, bounds, tied amplitudes, and the values of each log
    tied_amplitudes         sines and cosines of several logs with one amplitude
    step_size               the integration step that resolves the fastest motion
    shooting                one log's segments simulated, and their residual linearised
    shooting_problem        the same for all logs of a fit, as functions of θ and the initial states
    first_guess             of initial states, from the measured channels alone
    states                  initial states of segments, fitted at given parameters
    state_reconstruction    states from the channels of the sensors
    scaled_inverse          information matrices inverted or solved, scaled to a unit diagonal
    normal_equations        initial states eliminated (Schur complement); parts added up, projected, solved
    gauss_newton            the Levenberg-Marquardt iteration
    fit, fit_statistics     a fitted model, its covariances, its residual's colour
    covariance              block jackknife, test for autocorrelation
    estimate                value, standard error and unit of a parameter
    parameter_table         the estimates of a fit
    regressor, linear_fit   the input that acts, the equations of a log; their solution with standard errors
    least_squares           regression on the filtered equations, without and with derivatives (paper eqs. 16-43)
    long_logs               the same in chunks, for logs that do not fit into memory
    nonnegative             the same with nonnegative parameters: a start for shooting
    starts                  the start of a fit, from nominal values or filtered regressions
    profiled_starts         starts of parameters that mean nothing at the effect's absence
    ripple_search           the period of a ripple, from the residual of the filtered equations
    continuation            fits from short segments to full ones
    prediction, validation  errors on segments, with only their initial states fitted
    random_source           random forces and errors of sensors: rms, correlation time, where they act
    filter_error            a Kalman filter along every log, its innovations linearised
    residual_statistics     whiteness, independence of past inputs, size and shape of residuals
    scoring                 score and information of the filter's likelihood, with all that its gains change
    filter_fit              the likeliest parameters, sizes and correlation times
    source_search           which random sources a machine has, as few as suffice
    stored_sources          those that identification left in a model file
    correlation_time        how far parameters move with the correlation time that is assumed
    smoother                states and random forces from the whole log, back along a filter's steps
    workable_horizon        the longest horizon over which a model can be simulated
    noise_alarm             the warning of an error well below the noise floor
"""
