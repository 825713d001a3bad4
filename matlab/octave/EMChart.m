classdef EMChart < handle
%EMChart  What find(.., '-isa', 'Stateflow.EMChart', ..) finds in a model's object: the code of a MATLAB Function block.
% SPDX-License-Identifier: MIT
  properties
    Path = '';
    Script = sprintf('function y = fcn(u)\ny = u;\nend');
  end
  methods
    function chart = EMChart(path)
      chart.Path = path;
    end
  end
end
