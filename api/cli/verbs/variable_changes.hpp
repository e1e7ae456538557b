#pragma once

#include <map>
#include <string>
#include <vector>

#include "api/dds/variable_page.hpp"

namespace plchost {

/// Looks at the same variables again and again.
class VariableChanges {
 public:
  /// The result of a look.
  struct Found {
    std::vector<const plc_VariableRecord*> changed;  ///< in the sample
    std::vector<std::string> gone;                   ///< names that the sample before had
    bool is_first_torn = false;                      ///< the values may be of different cycles, unlike before
  };
  [[nodiscard]] Found look(const VariableListing& sample);

 private:
  std::map<std::string, std::string, std::less<>> last_;  // of each name the value, and whether it is forced
  bool torn_ = false;
};

}  // namespace plchost
