function results = Chapter17_Lesson1
%Chapter17_Lesson1  Adaptive backstepping on an uncertain second-order plant.
%   results = Chapter17_Lesson1 also returns t, x1, x2, thetaHat, referenceSignal and trackingError.
%
%   plant     x1' = x2 + theta x1,  x2' = u,  y = x1;  the controller does not know theta
%   task      x1 follows r(t), and every signal stays bounded
%   notation  z1, z2: error coordinates;  alpha1: virtual control;  tau2: tuning function;
%             phi: regressor;  theta: unknown parameter (1/s);  thetaHat: estimate of theta;
%             xDot: time derivative of x;
%             xDotKnown: xDot with thetaHat in the place of theta, as if constant;
%             alpha1X1: partial derivative of alpha1 with respect to x1
%   (n)       section n of the lesson, A. Mohammadijoo's Chapter 17, Lesson 1
%
%   run       matlab -batch Chapter17_Lesson1
%   or        octave-cli --path octave --eval Chapter17_Lesson1

% SPDX-License-Identifier: MIT

%% Parameters

thetaTrue = 1.2;      % (15) true parameter, unknown to the controller, 1/s
k1 = 2.0;             % (15) gain on z1, positive
k2 = 2.5;             % (15) gain on z2, positive
gamma = 3.0;          % (15) adaptation gain, positive
amplitude = 0.5;      % (15) of the reference
omega = 0.7;          % (15) of the reference, rad/s
x1Start = 1.2;        % (15) x1 at t = 0
x2Start = -0.5;       % (15) x2 at t = 0
thetaHatStart = 0.0;  % (15) thetaHat at t = 0
finalTime = 20.0;     % (15) horizon, s
relTol = 1e-9;        % of ode45
absTol = 1e-11;       % of ode45
maxStep = 0.02;       % of ode45, s

csvName = 'Chapter17_Lesson1_matlab.csv';
trackingName = 'Chapter17_Lesson1_matlab_tracking.png';
errorName = 'Chapter17_Lesson1_matlab_error.png';
estimateName = 'Chapter17_Lesson1_matlab_estimate.png';

%% Reference

    function [r, rDot, rDDot] = reference(t)
        r = amplitude * sin(omega * t);                       % (15) reference
        rDot = amplitude * omega * cos(omega * t);            % (15) its first derivative
        rDDot = -amplitude * omega * omega * sin(omega * t);  % (15) its second derivative
    end

%% Controller

    function phi = regressor(x1)
        phi = x1;  % (4) regressor
    end

    function [u, thetaHatDot] = controller(t, x1, x2, thetaHat)
        [r, rDot, rDDot] = reference(t);
        phi = regressor(x1);
        z1 = x1 - r;                                % (5) tracking error
        alpha1 = -k1 * z1 - thetaHat * phi + rDot;  % (7) virtual control
        z2 = x2 - alpha1;                           % (5) deviation from the virtual control
        % phi(x1) = x1 has the derivative 1
        alpha1X1 = -k1 - thetaHat;              % (7) partial derivative of alpha1 by x1
        tau2 = phi * z1 - alpha1X1 * phi * z2;  % (7) tuning function
        thetaHatDot = gamma * tau2;             % (7) update law
        % alpha1' with thetaHat in the place of theta, as if constant
        alpha1DotKnown = alpha1X1 * (x2 + thetaHat * phi) + k1 * rDot + rDDot;  % (7) known part
        % alpha1 moves with thetaHat too: hence the last term
        u = alpha1DotKnown - z1 - k2 * z2 - phi * thetaHatDot;  % (7) control
    end

%% Closed loop

    function derivative = closedLoop(t, state)
        x1 = state(1);
        x2 = state(2);
        thetaHat = state(3);
        [u, thetaHatDot] = controller(t, x1, x2, thetaHat);
        phi = regressor(x1);
        x1Dot = x2 + thetaTrue * phi;  % (7) plant, row 1
        x2Dot = u;                     % (7) plant, row 2
        derivative = [x1Dot; x2Dot; thetaHatDot];
    end

%% Integrate

    function [t, x1, x2, thetaHat] = simulate()
        initialState = [x1Start; x2Start; thetaHatStart];
        timeSpan = [0, finalTime];
        % Refine 1: the logged times are the solver's own steps, without interpolated ones between them
        options = odeset('RelTol', relTol, 'AbsTol', absTol, 'MaxStep', maxStep, 'Refine', 1);
        try
            [t, state] = ode45(@closedLoop, timeSpan, initialState, options);
        catch problem
            error('Chapter17_Lesson1:integration', 'Chapter17_Lesson1: integration failed: %s\n', problem.message);
        end
        if t(end) < finalTime || ~all(isfinite(state(:)))
            error('Chapter17_Lesson1:integration', ...
                  'Chapter17_Lesson1: integration failed at t = %g\n', t(end));
        end
        x1 = state(:, 1);
        x2 = state(:, 2);
        thetaHat = state(:, 3);
    end

%% Write CSV

    function writeCsv(t, x1, x2, thetaHat, referenceSignal, trackingError)
        % renamed when complete, so that no half-written CSV looks whole
        part = [csvName '.part'];
        file = -1;
        if ~isfolder(csvName)
            file = fopen(part, 'w');
        end
        written = file >= 0;
        if written
            bytes = fprintf(file, 't,x1,x2,theta_hat,reference,tracking_error\n') ...
                    + fprintf(file, '%.17g,%.17g,%.17g,%.17g,%.17g,%.17g\n', ...
                              [t, x1, x2, thetaHat, referenceSignal, trackingError]');
            fclose(file);
            info = dir(part);  % a full disk shows in the size
            written = isscalar(info) && info.bytes == bytes && movefile(part, csvName, 'f');
        end
        if ~written
            error('Chapter17_Lesson1:csv', 'Chapter17_Lesson1: cannot write %s\n', csvName);
        end
    end

%% Report

    function report(thetaHat, trackingError)
        fprintf('Final tracking error: %.6e\n', trackingError(end));
        fprintf('Final parameter estimate: %.10f\n', thetaHat(end));
        fprintf('True parameter: %.10f\n', thetaTrue);
        fprintf('Data written to %s\n', csvName);
    end

%% Figures

    function draw(t, x1, thetaHat, referenceSignal, trackingError)
        beginFigure();
        plot(t, x1, '-', t, referenceSignal, '--', 'LineWidth', 1.4);
        legend({'x_1', 'r'}, 'Location', 'northeast');
        endFigure('Adaptive-Backstepping Tracking', 'output y', trackingName);

        beginFigure();
        plot(t, trackingError, '-', 'LineWidth', 1.4);
        legend({'z_1 = x_1 - r'}, 'Location', 'northeast');
        endFigure('Tracking Error', 'tracking error z_1', errorName);

        beginFigure();
        plot(t, thetaHat, '-', 'LineWidth', 1.4);
        yline(thetaTrue, '--', 'LineWidth', 1.4);
        legend({'estimate of \theta', '\theta'}, 'Location', 'northeast');
        endFigure('Parameter Estimate', 'parameter (1/s)', estimateName);
    end

    function beginFigure()
        if inDesktop()
            figure();
        else
            figure('Visible', 'off');
        end
    end

    function endFigure(heading, label, name)
        title(heading);
        xlabel('time (s)');
        ylabel(label);
        grid('on');
        if ~inDesktop()  % headless, the figure becomes a PNG file
            print(gcf(), name, '-dpng');
            close(gcf());
        end
    end

    function answer = inDesktop()
        % usejava is on its way out, and says no in MATLAB Online; where desktop cannot tell, usejava does
        try
            answer = desktop('inuse');
        catch
            answer = usejava('desktop');
        end
    end

    function trajectory = main()
        [t, x1, x2, thetaHat] = simulate();
        referenceSignal = arrayfun(@reference, t);
        trackingError = x1 - referenceSignal;
        writeCsv(t, x1, x2, thetaHat, referenceSignal, trackingError);
        report(thetaHat, trackingError);
        draw(t, x1, thetaHat, referenceSignal, trackingError);
        trajectory = struct('t', t, 'x1', x1, 'x2', x2, 'thetaHat', thetaHat, 'referenceSignal', referenceSignal, ...
                            'trackingError', trackingError);
    end

solved = main();
if nargout > 0
    results = solved;
end
end
