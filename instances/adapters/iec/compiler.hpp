#pragma once

namespace plchost::iec {

/// The compiler that translates the program.
enum class Compiler : unsigned char { matiec, strucpp };

}  // namespace plchost::iec
