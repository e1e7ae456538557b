#include "instances/adapters/strucpp/compiler.hpp"

#include <filesystem>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "instances/adapters/iec/environment.hpp"

namespace plchost::strucpp {

namespace {

namespace fs = std::filesystem;

bool is_there(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

/// As STruC++ is built, and as npm installs it.
std::optional<Compiler> compiler_of(const fs::path& folder) {
  if (!is_there(folder / "dist" / "node" / "index.js") || !is_there(folder / "libs")) return std::nullopt;
  for (const fs::path& headers :
       {folder / "src" / "runtime" / "include", folder / "dist" / "runtime" / "include"}) {
    if (is_there(headers / "iec_std_lib.hpp")) return Compiler{.folder = folder, .headers = headers};
  }
  return std::nullopt;
}

}  // namespace

Result<Compiler> find_compiler(const std::string& folder) {
  const std::string chosen = folder.empty() ? iec::environment("PLCHOST_STRUCPP") : folder;
  std::error_code error;
  if (!chosen.empty()) {
    if (auto found = compiler_of(fs::absolute(chosen, error))) return *std::move(found);
    return failure(ErrorCode::not_found,
                   fmt::format("there is no built STruC++ (dist/node/index.js, libs, src/runtime/include) in "
                               "{}; build it there: npm ci --ignore-scripts && npm run build",
                               chosen));
  }
  // npm makes a link to dist/node/cli.js.
  for (const fs::path& program : iec::in_path("strucpp")) {
    const fs::path script = fs::canonical(program, error);
    if (error) continue;
    if (auto found = compiler_of(script.parent_path().parent_path().parent_path())) return *std::move(found);
  }
  return failure(
      ErrorCode::not_found,
      "STruC++ was not found. Build it (github.com/Autonomy-Logic/STruCpp), and name its folder by "
      "--strucpp or PLCHOST_STRUCPP");
}

}  // namespace plchost::strucpp
