# Mathematica: the notebook's Input cells, run in order without a front end. It is slow, so it comes early.
KNOWN_PORTS := mathematica $(KNOWN_PORTS)
FOLDER.mathematica := mathematica

$(BUILD)/mathematica/done: mathematica/port.toml $(addprefix $(FROM),mathematica/$(STEM).nb $(wildcard mathematica/*.wl mathematica/*.wls))
