# Mathematica: the notebook's Input cells, run in order without a front end. It is slow, so it comes early.
KNOWN_PORTS := mathematica $(KNOWN_PORTS)
FOLDER.mathematica := mathematica

build/mathematica/done: mathematica/port.toml $(wildcard mathematica/*.nb mathematica/*.wl mathematica/*.wls)
