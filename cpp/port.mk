# C++: compiled once per change of the source, without a warning.
KNOWN_PORTS += cpp
FOLDER.cpp := cpp

CXXFLAGS := -std=c++17 -O2 -Wall -Wextra -Wpedantic -Wconversion -Werror

$(BUILD)/cpp/bin/$(STEM): $(FROM)cpp/$(STEM).cpp cpp/port.mk | environment
	@$(RUN) --engine cpp
	@mkdir -p $(@D)
	g++ $(CXXFLAGS) -o $@ $<

$(BUILD)/cpp/done: cpp/port.toml $(BUILD)/cpp/bin/$(STEM)
