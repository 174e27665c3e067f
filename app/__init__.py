"""The desktop application and the command line; the only package that depends on Qt."""
