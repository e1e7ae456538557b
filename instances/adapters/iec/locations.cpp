#include "instances/adapters/iec/locations.hpp"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <iterator>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "instances/adapters/iec/tokens.hpp"

namespace plchost::iec {

namespace {

constexpr std::size_t kMostNamed = 8;  // of the locations that share bits

std::string_view name_of_area(char area) noexcept {
  return area == 'I' ? "inputs" : area == 'Q' ? "outputs" : "memory";
}

// "bit 3 of byte 0", "bytes 4 to 7"
std::string bytes_of(const Place& place) {
  if (place.bit >= 0) return fmt::format("bit {} of byte {}", place.bit, place.offset);
  if (place.bytes == 1) return fmt::format("byte {}", place.offset);
  return fmt::format("bytes {} to {}", place.offset, place.offset + place.bytes - 1);
}

}  // namespace

Locations::Locations(const Project& project, const Configuration& configuration)
    : options_(configuration.locations) {
  for (const Pou& pou : project.pous) add(pou.variables);
  add(configuration.globals);
  for (const Resource& resource : configuration.resources) add(resource.globals);
  place_all();
  choose_places();
}

void Locations::add(const std::vector<Variable>& variables) {
  for (const Variable& variable : variables) {
    if (variable.location.empty()) continue;
    if (auto location = location_of(variable.location))
      all_.try_emplace(*std::move(location), Located{.first = &variable});
  }
}

void Locations::place_all() {
  for (auto& [location, located] : all_) {
    const auto given = options_.given.find(location);
    if (given != options_.given.end()) {
      located.place = place_of(given->second.location, options_.widths);
    } else if (location.is_hierarchical()) {
      located.is_chosen = true;
    } else {
      located.place = place_of(location, options_.widths);
    }
  }
}

// In the order of their numbers, each behind those before it and behind all that the program or the task file
// has placed.
void Locations::choose_places() {
  // Of an area, or with separate locations of a width in it.
  std::map<std::tuple<char, unsigned, bool>, unsigned> ends;
  const auto end_of = [&](const Location& location) -> unsigned& {
    const bool is_shared = options_.widths == Widths::shared;
    const std::tuple key(location.area, is_shared ? 0U : location.bytes, !is_shared && location.is_bit);
    const auto begin = [&] {
      Location first{
          .area = location.area, .numbers = {0}, .bytes = location.bytes, .is_bit = location.is_bit};
      if (first.is_bit) first.numbers.push_back(0);
      return is_shared ? 0U : first_bit(*place_of(first, options_.widths));
    };
    const auto found = ends.find(key);
    return found != ends.end() ? found->second : ends.emplace(key, begin()).first->second;
  };
  for (const auto& [location, located] : all_) {
    if (located.is_chosen || !located.place) continue;
    unsigned& end = end_of(location);
    end = std::max(end, end_bit(*located.place));
  }
  for (auto& [location, located] : all_) {
    if (!located.is_chosen) continue;
    unsigned& end = end_of(location);
    const unsigned bits = location.is_bit ? 1 : location.bytes * 8;
    const unsigned begin = (end + bits - 1) / bits * bits;
    const Place place{.area = location.area,
                      .offset = begin / 8,
                      .bytes = location.bytes,
                      .bit = location.is_bit ? static_cast<int>(begin % 8) : -1};
    end = begin + bits;
    located.place = place_of(location_of(place, options_.widths), options_.widths);
  }
}

std::expected<Place, std::string> Locations::place(std::string_view location) const {
  auto known = location_of(location);
  if (!known) return std::unexpected(std::move(known.error()));
  const auto found = all_.find(*known);
  return found == all_.end() ? place_of(*known, options_.widths) : found->second.place;
}

std::vector<std::pair<std::string, Place>> Locations::places() const {
  std::vector<std::pair<std::string, Place>> result;
  for (const auto& [location, located] : all_) {
    if (located.place) result.emplace_back(location.text(), *located.place);
  }
  return result;
}

SourceProblems Locations::remarks() const {
  SourceProblems remarks;
  name_chosen(remarks);
  name_separate(remarks);
  name_shared_bits(remarks);
  name_idle_lines(remarks);
  return remarks;
}

void Locations::name_chosen(SourceProblems& remarks) const {
  for (const auto& [location, located] : all_) {
    if (!located.is_chosen || !located.place) continue;
    const std::string text = location.text();
    remarks.push_back(
        {located.first->place,
         fmt::format("{} lies in {} of the {}. It may move in a later build, unless [location] of the "
                     "task file has the line \"{}\" = \"{}\"",
                     text, bytes_of(*located.place), name_of_area(location.area), text,
                     location_of(*located.place, options_.widths).text())});
  }
}

// All of an area in one remark, in the order of their bytes.
void Locations::name_separate(SourceProblems& remarks) const {
  if (options_.widths == Widths::shared) return;
  for (const char area : {'I', 'Q', 'M'}) {
    std::vector<std::pair<Place, const std::pair<const Location, Located>*>> order;
    for (const auto& entry : all_) {
      if (entry.first.area == area && entry.second.place) order.emplace_back(*entry.second.place, &entry);
    }
    if (order.empty()) continue;
    std::ranges::sort(order, {}, [](const auto& one) { return std::pair(one.first, one.second->first); });
    std::vector<std::string> texts;
    for (const auto& [place, entry] : order)
      texts.push_back(fmt::format("{} in {}", entry->first.text(), bytes_of(place)));
    remarks.push_back(
        {order.front().second->second.first->place, fmt::format("locations = \"separate\": the {} have {}",
                                                                name_of_area(area), fmt::join(texts, ", "))});
  }
}

// Each place lies at a multiple of its width, so the first and widest one of a group has all others in it.
void Locations::name_shared_bits(SourceProblems& remarks) const {
  using Entry = const std::pair<const Location, Located>*;
  std::vector<Entry> order;
  for (const auto& entry : all_) {
    if (entry.second.place) order.push_back(&entry);
  }
  std::ranges::sort(order, {}, [](Entry entry) {
    const Place& place = *entry->second.place;
    const auto bits = static_cast<int>(end_bit(place) - first_bit(place));
    return std::tuple(place.area, first_bit(place), -bits, entry->first);
  });
  for (auto begin = order.begin(); begin != order.end();) {
    const Place& place = *(*begin)->second.place;
    const auto end = std::find_if(begin, order.end(), [&](Entry entry) {
      const Place& other = *entry->second.place;
      return other.area != place.area || first_bit(other) >= end_bit(place);
    });
    std::vector<std::string> others;
    for (auto other = std::next(begin); other != end; ++other) others.push_back((*other)->first.text());
    const std::size_t more = others.size() - std::min(others.size(), kMostNamed);
    others.resize(others.size() - more);
    if (!others.empty()) {
      remarks.push_back(
          {(*begin)->second.first->place,
           fmt::format("{} shares its bits with {}{}: a value at one of them changes the others{}",
                       (*begin)->first.text(), fmt::join(others, ", "),
                       more == 0 ? "" : fmt::format(" and {} more", more),
                       options_.widths == Widths::separate
                           ? ""
                           : ". If they lie apart, as in OpenPLC, set locations = \"separate\" in the "
                             "task file")});
    }
    begin = end;
  }
}

void Locations::name_idle_lines(SourceProblems& remarks) const {
  for (const auto& [location, given] : options_.given) {
    if (!all_.contains(location))
      remarks.push_back({given.place, fmt::format("no variable lies at {}", location.text())});
  }
}

}  // namespace plchost::iec
