"""The command line: one small file a command, each with HELP, EXAMPLE, add_arguments(parser) and
run(args).
"""
