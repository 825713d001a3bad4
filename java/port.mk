# Java: compiled once per change of the source, without a warning.
KNOWN_PORTS += java
FOLDER.java := java

JAVACFLAGS := -Xlint:all -Werror -J-XX:TieredStopAtLevel=1 -J-XX:+UseSerialGC  # -J: a compiler that starts fast

build/java/bin/Chapter17_Lesson1.class: java/Chapter17_Lesson1.java java/port.mk | environment
	@$(RUN) --engine java
	@mkdir -p $(@D)
	javac $(JAVACFLAGS) -d $(@D) $<

build/java/done: java/port.toml build/java/bin/Chapter17_Lesson1.class
