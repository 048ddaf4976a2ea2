"""What `make bench` measures: speed, memory and tightness beside published figures."""
