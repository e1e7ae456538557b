#pragma once

#include <expected>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "instances/adapters/iec/place.hpp"
#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/source_place.hpp"

namespace plchost::iec {

/// Where each location of a program lies: by its numbers, by the task file, or at a place that is chosen
/// here. The order of the declarations does not count.
class Locations {
 public:
  Locations() = default;
  /// Of all located variables of the project.
  Locations(const Project& project, const Configuration& configuration);

  /// The error says what is allowed.
  [[nodiscard]] std::expected<Place, std::string> place(std::string_view location) const;

  /// Of all that have one, in the order of their numbers.
  [[nodiscard]] std::vector<std::pair<std::string, Place>> places() const;

  /// Told to the author: places that were chosen, places with locations apart, shared bits.
  [[nodiscard]] SourceProblems remarks() const;

 private:
  struct Located {
    const Variable* first = nullptr;  ///< in the order of the source
    std::expected<Place, std::string> place = {};
    bool is_chosen = false;
  };

  void add(const std::vector<Variable>& variables);
  void place_all();
  void choose_places();
  void name_chosen(SourceProblems& remarks) const;
  void name_separate(SourceProblems& remarks) const;
  void name_shared_bits(SourceProblems& remarks) const;
  void name_idle_lines(SourceProblems& remarks) const;

  LocationOptions options_;
  std::map<Location, Located> all_;
};

}  // namespace plchost::iec
