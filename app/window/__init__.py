"""The main window, with its menus and dialogs."""
