# Python: run as it is.
KNOWN_PORTS := python $(KNOWN_PORTS)  # a slow one, so first
FOLDER.python := python

build/python/done: python/port.toml python/Chapter17_Lesson1.py
