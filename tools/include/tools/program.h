// The command line: see docs/ and `plumbline --help`.
#pragma once

namespace plumbline::tools {

// What main() does with its arguments, argv[0] being the program's name. Prints to stdout and stderr, returns the exit
// code (tools/commands.h), throws nothing.
int program(int argc, const char* const* argv);

}  // namespace plumbline::tools
