# Java: compiled once per change of the source, without a warning.
KNOWN_PORTS += java
FOLDER.java := java

JAVACFLAGS := -Xlint:all -Werror -J-XX:TieredStopAtLevel=1 -J-XX:+UseSerialGC  # -J: a compiler that starts fast

$(BUILD)/java/bin/$(STEM).class: $(FROM)java/$(STEM).java java/port.mk | environment
	@$(RUN) --engine java
	@mkdir -p $(@D)
	javac $(JAVACFLAGS) -d $(@D) $<

$(BUILD)/java/done: java/port.toml $(BUILD)/java/bin/$(STEM).class
