function Chapter17_Lesson1
%Chapter17_Lesson1  Adaptive backstepping on an uncertain second-order plant.
%
%   plant     x1' = x2 + theta x1,  x2' = u,  y = x1;  the controller does not know theta
%   task      x1 follows r(t), and every signal stays bounded
%   notation  z1, z2: error coordinates;  alpha1: virtual control;  tau2: tuning function;
%             theta_hat: estimate of theta;  x_dot: time derivative of x;
%             alpha1_x1: partial derivative of alpha1 with respect to x1
%   (n)       section n of the lesson

% SPDX-License-Identifier: MIT

%% Parameters

theta = 1.2;            % (10) true parameter, used by the plant alone
k1 = 2.0;               % (10) gain on z1, positive
k2 = 2.5;               % (10) gain on z2, positive
gamma = 3.0;            % (10) adaptation gain, positive
amplitude = 0.5;        % (10) of the reference
omega = 0.7;            % (10) of the reference, rad/s
x1_start = 1.2;         % (10) x1 at t = 0
x2_start = -0.5;        % (10) x2 at t = 0
theta_hat_start = 0.0;  % (10) theta_hat at t = 0
t_final = 20.0;         % (10) horizon, s
rel_tol = 1e-9;         % of ode45
abs_tol = 1e-11;        % of ode45
max_step = 0.02;        % of ode45, s

csv_name = 'Chapter17_Lesson1_matlab.csv';
png_name = 'Chapter17_Lesson1_matlab.png';

%% Reference

    function [r, r_dot, r_ddot] = reference(t)
        r = amplitude * sin(omega * t);                        % (10) reference
        r_dot = amplitude * omega * cos(omega * t);            % (10) its first derivative
        r_ddot = -amplitude * omega * omega * sin(omega * t);  % (10) its second derivative
    end

%% Controller

    function [u, theta_hat_dot] = controller(t, x1, x2, theta_hat)
        [r, r_dot, r_ddot] = reference(t);
        z1 = x1 - r;                                  % (5) tracking error
        alpha1 = -k1 * z1 - theta_hat * x1 + r_dot;   % (7) virtual control
        z2 = x2 - alpha1;                             % (5) distance from the virtual control
        alpha1_x1 = -k1 - theta_hat;                  % (7) partial derivative of alpha1
        tau2 = x1 * z1 - alpha1_x1 * x1 * z2;         % (7) tuning function
        theta_hat_dot = gamma * tau2;                 % (7) update law
        alpha1_dot_known = alpha1_x1 * (x2 + theta_hat * x1) + k1 * r_dot + r_ddot;  % (7) known part of alpha1'
        u = alpha1_dot_known - z1 - k2 * z2 - x1 * theta_hat_dot;  % (7) control
    end

%% Closed loop

    function state_dot = closed_loop(t, state)
        x1 = state(1);
        x2 = state(2);
        theta_hat = state(3);
        [u, theta_hat_dot] = controller(t, x1, x2, theta_hat);
        x1_dot = x2 + theta * x1;  % (7) plant, row 1
        x2_dot = u;                % (7) plant, row 2
        state_dot = [x1_dot; x2_dot; theta_hat_dot];
    end

%% Integrate

    function [t, x1, x2, theta_hat] = simulate()
        options = odeset('RelTol', rel_tol, 'AbsTol', abs_tol, 'MaxStep', max_step);
        try
            [t, states] = ode45(@closed_loop, [0, t_final], [x1_start; x2_start; theta_hat_start], options);
        catch problem
            error('Chapter17_Lesson1:integration', 'Chapter17_Lesson1: integration failed: %s\n', problem.message);
        end
        if t(end) < t_final || ~all(isfinite(states(:)))
            error('Chapter17_Lesson1:integration', ...
                  'Chapter17_Lesson1: integration failed at t = %g\n', t(end));
        end
        [x1, x2, theta_hat] = deal(states(:, 1), states(:, 2), states(:, 3));
    end

%% Write CSV

    function write_csv(t, x1, x2, theta_hat)
        r = reference(t);
        part = [csv_name '.part'];  % renamed when complete, so that no half-written CSV looks whole
        file = -1;
        if ~isfolder(csv_name)
            file = fopen(part, 'w');
        end
        written = file >= 0;
        if written
            bytes = fprintf(file, 't,x1,x2,theta_hat,reference,tracking_error\n') ...
                    + fprintf(file, '%.17g,%.17g,%.17g,%.17g,%.17g,%.17g\n', [t, x1, x2, theta_hat, r, x1 - r]');
            fclose(file);
            info = dir(part);
            written = info.bytes == bytes && movefile(part, csv_name);  % a full disk shows in the size
        end
        if ~written
            error('Chapter17_Lesson1:csv', 'Chapter17_Lesson1: cannot write %s\n', csv_name);
        end
    end

%% Report

    function report(t, x1, theta_hat)
        r = reference(t);
        fprintf('Final tracking error: %.6e\n', x1(end) - r(end));
        fprintf('Final parameter estimate: %.10f\n', theta_hat(end));
        fprintf('True parameter: %.10f\n', theta);
        fprintf('Data written to %s\n', csv_name);
    end

%% Figures

    function draw(t, x1, theta_hat)
        r = reference(t);
        windows = usejava('desktop');  % headless, the figure becomes a PNG file
        if windows
            window = figure();
        else
            window = figure('Visible', 'off');
        end
        subplot(3, 1, 1);
        plot(t, x1, '-', t, r, '--');
        ylabel('output y');
        legend({'x_1', 'r'});
        subplot(3, 1, 2);
        plot(t, x1 - r, '-');
        ylabel('tracking error z_1');
        legend({'z_1'});
        subplot(3, 1, 3);
        plot(t, theta_hat, '-', t, theta + 0 * t, '--');
        ylabel('parameter, 1/s');
        legend({'estimate of \theta', '\theta'});
        xlabel('time (s)');
        if ~windows
            print(window, png_name, '-dpng');
            close(window);
        end
    end

    function main()
        [t, x1, x2, theta_hat] = simulate();
        write_csv(t, x1, x2, theta_hat);
        report(t, x1, theta_hat);
        draw(t, x1, theta_hat);
    end

main();
end
