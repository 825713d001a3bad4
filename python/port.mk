# Python: run as it is.
KNOWN_PORTS += python
FOLDER.python := python

build/python/done: python/port.toml python/Chapter17_Lesson1.py
