# Go: compiled once per change of the source.
KNOWN_PORTS += go
FOLDER.go := go

build/go/bin/Chapter17_Lesson1: go/Chapter17_Lesson1.go go/port.mk | environment
	@$(RUN) --engine go
	@mkdir -p $(@D)
	go build -buildvcs=false -o $@ $<

build/go/done: go/port.toml build/go/bin/Chapter17_Lesson1
