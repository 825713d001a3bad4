function results = Chapter17_Lesson1_Simulink
%Chapter17_Lesson1_Simulink  The same program as Chapter17_Lesson1, as a Simulink model built here.
%   results = Chapter17_Lesson1_Simulink also returns t, x1, x2, thetaHat, referenceSignal and trackingError.
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
%   run       matlab -batch Chapter17_Lesson1_Simulink
%   or        octave-cli --path octave --eval Chapter17_Lesson1_Simulink

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

csvName = 'Chapter17_Lesson1_simulink.csv';
trackingName = 'Chapter17_Lesson1_simulink_tracking.png';
model = 'Chapter17_Lesson1_Simulink_Model';

% The block's code cannot see the variables above: these lines put their values into it.
parameters = {
    ['thetaTrue = ' mat2str(thetaTrue, 17) ';']
    ['k1 = ' mat2str(k1, 17) ';']
    ['k2 = ' mat2str(k2, 17) ';']
    ['gamma = ' mat2str(gamma, 17) ';']
    ['amplitude = ' mat2str(amplitude, 17) ';']
    ['omega = ' mat2str(omega, 17) ';']
    };

%% Reference

reference = {
    'r = amplitude * sin(omega * t);                       % (15) reference'
    'rDot = amplitude * omega * cos(omega * t);            % (15) its first derivative'
    'rDDot = -amplitude * omega * omega * sin(omega * t);  % (15) its second derivative'
    };

%% Controller

controller = {
    'phi = x1;                                   % (4) regressor'
    'z1 = x1 - r;                                % (5) tracking error'
    'alpha1 = -k1 * z1 - thetaHat * phi + rDot;  % (7) virtual control'
    'z2 = x2 - alpha1;                           % (5) deviation from the virtual control'
    '% phi(x1) = x1 has the derivative 1'
    'alpha1X1 = -k1 - thetaHat;              % (7) partial derivative of alpha1 by x1'
    'tau2 = phi * z1 - alpha1X1 * phi * z2;  % (7) tuning function'
    'thetaHatDot = gamma * tau2;             % (7) update law'
    '% alpha1'' with thetaHat in the place of theta, as if constant'
    'alpha1DotKnown = alpha1X1 * (x2 + thetaHat * phi) + k1 * rDot + rDDot;  % (7) known part'
    '% alpha1 moves with thetaHat too: hence the last term'
    'u = alpha1DotKnown - z1 - k2 * z2 - phi * thetaHatDot;  % (7) control'
    };

%% Closed loop

plant = {
    'x1Dot = x2 + thetaTrue * phi;  % (7) plant, row 1'
    'x2Dot = u;                     % (7) plant, row 2'
    };

closedLoop = [
    {'function [derivative, referenceSignal] = fcn(t, state)'; '%#codegen'}
    parameters
    {'x1 = state(1);'; 'x2 = state(2);'; 'thetaHat = state(3);'}
    reference
    controller
    plant
    {'derivative = [x1Dot; x2Dot; thetaHatDot];'; 'referenceSignal = r;'; 'end'}
    ];

    function buildModel()
        if bdIsLoaded(model)
            close_system(model, 0);
        end
        if isfile([model '.slx'])
            delete([model '.slx']);
        end
        new_system(model, 'Model');
        add_block('simulink/Sources/Clock', [model '/Clock'], 'Position', [40, 55, 70, 85]);
        add_block('simulink/User-Defined Functions/MATLAB Function', [model '/Adaptive Closed Loop'], ...
                  'Position', [140, 40, 280, 140]);
        add_block('simulink/Continuous/Integrator', [model '/State Integrator'], 'Position', [340, 50, 380, 80], ...
                  'InitialCondition', mat2str([x1Start; x2Start; thetaHatStart], 17));
        add_block('simulink/Sinks/To Workspace', [model '/State Data'], 'Position', [460, 50, 540, 80], ...
                  'VariableName', 'stateData', 'SaveFormat', 'Structure With Time', 'MaxDataPoints', 'inf');
        add_block('simulink/Sinks/To Workspace', [model '/Reference Data'], 'Position', [310, 100, 395, 130], ...
                  'VariableName', 'referenceData', 'SaveFormat', 'Structure With Time', 'MaxDataPoints', 'inf');
        % the block has the ports of its function once it has the function, and not before
        block = find(get_param(model, 'Object'), '-isa', 'Stateflow.EMChart', ...
                     'Path', [model '/Adaptive Closed Loop']);
        block.Script = strjoin(closedLoop', sprintf('\n'));
        add_line(model, 'Clock/1', 'Adaptive Closed Loop/1', 'autorouting', 'on');
        add_line(model, 'State Integrator/1', 'Adaptive Closed Loop/2', 'autorouting', 'on');
        add_line(model, 'Adaptive Closed Loop/1', 'State Integrator/1', 'autorouting', 'on');
        add_line(model, 'Adaptive Closed Loop/2', 'Reference Data/1', 'autorouting', 'on');
        add_line(model, 'State Integrator/1', 'State Data/1', 'autorouting', 'on');
        set_param(model, 'SolverType', 'Variable-step', 'Solver', 'ode45', 'StartTime', '0', ...
                  'StopTime', mat2str(finalTime, 17), 'RelTol', mat2str(relTol, 17), 'AbsTol', mat2str(absTol, 17), ...
                  'AutoScaleAbsTol', 'off', 'MaxStep', mat2str(maxStep, 17), 'Refine', '1');
        save_system(model, [model '.slx']);
    end

%% Integrate

    function [t, x1, x2, thetaHat, referenceSignal] = simulate()
        buildModel();
        try
            output = sim(model, 'ReturnWorkspaceOutputs', 'on');
        catch problem
            error('Chapter17_Lesson1:integration', 'Chapter17_Lesson1: integration failed: %s\n', problem.message);
        end
        t = output.stateData.time;
        % by release, a column signal is logged as N-by-3, as 3-by-1-by-N, or as one column of 3 N: all become N-by-3
        state = output.stateData.signals.values;
        if size(state, 1) ~= numel(t)
            state = reshape(state, 3, [])';
        end
        referenceSignal = output.referenceData.signals.values(:);
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

    function draw(t, x1, referenceSignal)
        if inDesktop()
            figure();
        else
            figure('Visible', 'off');
        end
        plot(t, x1, '-', t, referenceSignal, '--', 'LineWidth', 1.4);
        legend({'x_1', 'r'}, 'Location', 'northeast');
        title('Adaptive-Backstepping Tracking');
        xlabel('time (s)');
        ylabel('output y');
        grid('on');
        if ~inDesktop()  % headless, the figure becomes a PNG file
            print(gcf(), trackingName, '-dpng');
            close(gcf());
        end
    end

    function showModel()
        if inDesktop()
            open_system(model);
            fprintf('Model saved to %s.slx\n', model);
        else
            close_system(model, 0);
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
        [t, x1, x2, thetaHat, referenceSignal] = simulate();
        trackingError = x1 - referenceSignal;
        writeCsv(t, x1, x2, thetaHat, referenceSignal, trackingError);
        report(thetaHat, trackingError);
        draw(t, x1, referenceSignal);
        showModel();
        trajectory = struct('t', t, 'x1', x1, 'x2', x2, 'thetaHat', thetaHat, 'referenceSignal', referenceSignal, ...
                            'trackingError', trackingError);
    end

solved = main();
if nargout > 0
    results = solved;
end
end
