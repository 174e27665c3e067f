"""The open volume and model and the edited state; independent of widgets."""
