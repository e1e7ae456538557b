#pragma once

#include <string>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/process/file_view.hpp"

namespace plchost {

/// Folders of a host that its API server uses; empty: there is none.
struct ServerFolders {
  std::string run;
  std::string audit;
  std::string applications;
  std::string identity;
};

/// The rights of the API server that has a user of its own.
struct OwnUser {
  std::string user;   ///< name or number
  int most_fifo = 0;  ///< the highest priority of SCHED_FIFO that it may still take; 0: none
  FileView files;
};

/// The files that the server of such a host uses.
[[nodiscard]] FileView files_of_server(const ServerFolders& folders);

/// Makes the process one of that user, for good: with the group that it has now, the user's other groups, no
/// capability, no_new_privs, and the sight of `files` only. invalid_argument: there is no such user, or it is
/// root. refused: the process may not. Gives back what this kernel cannot do; empty: all is done. Before
/// other threads are made. Set-up.
[[nodiscard]] Result<std::string> become_user(const OwnUser& wanted);

}  // namespace plchost
