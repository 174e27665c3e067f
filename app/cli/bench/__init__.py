"""The ``bench`` commands: `commands` has their options, a module of its own what each does."""
