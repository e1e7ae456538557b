#pragma once

#include <string>
#include <string_view>

#include "manager/store/store_order.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The work of the helper process. Waits for disks and for the process that tries the file.
///
/// Keeps a file. Copies it: the copy must have the announced digest, so that the sender can no longer change
/// it. Then puts the copy in place, has it tried, writes its description, and removes versions that are too
/// many. Gives its path. Was the same file loaded already, that one's. Of a file that is refused, and of a
/// helper that was killed, nothing counts. corrupt: not the announced size or digest. invalid_argument: no
/// application for this host; the text is that of the trial. timed_out: the trial. system: the disk is full,
/// the folder cannot be written.
///
/// Makes a path the boot application: gives that path.
[[nodiscard]] Result<std::string> carry_out(const StoreOrder& order);

/// main() of the helper: the result on standard output, the error's code as the exit code.
[[nodiscard]] int store_main(std::string_view order);

}  // namespace plchost
