# Mathematica: the notebook's Input cells, run in order without a front end.
KNOWN_PORTS := mathematica $(KNOWN_PORTS)  # a slow one, so first
FOLDER.mathematica := mathematica

build/mathematica/done: mathematica/port.toml $(wildcard mathematica/*.nb mathematica/*.wl mathematica/*.wls)
