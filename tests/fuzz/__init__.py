"""A fuzz job: mutated files of every format that tfscope reads, each in a child process."""
