#pragma once

namespace plchost {

/// Gives the reader of a command that goes on until Ctrl-C what was printed. std::system_error: the standard
/// output takes no more, as on a full disk. That ends the command: see main().
void flush_output();

}  // namespace plchost
