"""How fast and how exact the parts of tfscope are on this machine."""
