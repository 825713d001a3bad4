function loaded = bdIsLoaded(name)
%bdIsLoaded  Whether a model of that name is in memory.
% SPDX-License-Identifier: MIT
  loaded = simulink_models('has', name);
end
