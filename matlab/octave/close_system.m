function close_system(name, save)
%close_system  Remove the model from memory; save, if given, must be 0: nothing is saved on closing.
% SPDX-License-Identifier: MIT
  if nargin > 1 && save
    error('Simulink:Commands:CloseSave', 'close_system(''%s'', 1): save the model with save_system\n', name);
  end
  simulink_models('drop', name);
end
