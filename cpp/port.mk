# C++: compiled once per change of the source, without a warning.
KNOWN_PORTS += cpp
FOLDER.cpp := cpp

CXXFLAGS := -std=c++17 -O2 -Wall -Wextra -Wpedantic -Wconversion -Werror

build/cpp/bin/Chapter17_Lesson1: cpp/Chapter17_Lesson1.cpp cpp/port.mk | environment
	@$(RUN) --engine cpp
	@mkdir -p $(@D)
	g++ $(CXXFLAGS) -o $@ $<

build/cpp/done: cpp/port.toml build/cpp/bin/Chapter17_Lesson1
