# Java: compiled once per change of the source, without a warning.
KNOWN_PORTS += java
FOLDER.java := java

build/java/bin/Chapter17_Lesson1.class: java/Chapter17_Lesson1.java java/port.mk | environment
	@$(RUN) --engine java
	@mkdir -p $(@D)
	javac -Xlint:all -Werror -d $(@D) $<

build/java/done: java/port.toml build/java/bin/Chapter17_Lesson1.class
