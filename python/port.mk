# Python: run as it is. Its imports are slow, so it comes early.
KNOWN_PORTS := python $(KNOWN_PORTS)
FOLDER.python := python

$(BUILD)/python/done: python/port.toml $(FROM)python/$(STEM).py
