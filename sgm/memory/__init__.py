"""What a robot remembers of a home: tables of many homes, and the memory of one."""
