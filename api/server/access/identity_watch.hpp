#pragma once

#include <cstdint>
#include <string>

namespace plchost {

/// Sees that the folder of the host's identity has changed. Looks at its files' names, times and sizes, at
/// most some thousand; files that are copied there one by one count when all is quiet. Control loop only.
class IdentityWatch {
 public:
  enum class Change : std::uint8_t {
    none,
    known,     ///< the certificates of others: to be read again
    identity,  ///< the files that DDS has loaded, the list of revoked certificates included: takes a fresh
               ///< process
  };

  explicit IdentityWatch(std::string folder);

  /// Once for each change, when two looks in a row have seen the same.
  [[nodiscard]] Change look();

 private:
  struct Stamp {
    std::uint64_t own = 0;
    std::uint64_t known = 0;
    bool operator==(const Stamp&) const = default;
  };
  [[nodiscard]] Stamp stamp() const;

  std::string folder_;
  Stamp told_;
  Stamp last_;
};

}  // namespace plchost
