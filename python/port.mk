# Python: run as it is. Its imports are slow, so it comes early.
KNOWN_PORTS := python $(KNOWN_PORTS)
FOLDER.python := python

build/python/done: python/port.toml python/Chapter17_Lesson1.py
