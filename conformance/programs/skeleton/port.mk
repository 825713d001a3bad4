# NAME: run as it is. A compiled language has a rule for its program here, as cpp/port.mk has.
KNOWN_PORTS += NAME
FOLDER.NAME := NAME

build/NAME/done: NAME/port.toml NAME/Chapter17_Lesson1.awk
