// The states that a power cut may leave: which of them DiskModel looks at.
#include <algorithm>
#include <random>
#include <unordered_set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "tests/integration/storage/disk_model.hpp"

namespace plchost {

namespace {

constexpr std::size_t kSector = 512;
constexpr std::size_t kBlock = 4096;
constexpr std::size_t kMostBorders = 4;
constexpr int kRandom = 6;  // of each kind, beside those with a reason

// Up to kMostBorders of those within the bytes from `begin` on, as distances from it.
std::vector<std::size_t> borders(std::size_t begin, std::size_t size, std::size_t unit) {
  std::vector<std::size_t> all;
  for (std::size_t at = begin / unit * unit + unit; at < begin + size; at += unit) all.push_back(at - begin);
  if (all.size() <= kMostBorders) return all;
  return {all[0], all[all.size() / 3], all[2 * all.size() / 3], all.back()};
}

std::size_t hash_of(const FileTree& tree, std::size_t marks) {
  std::size_t hash = marks;
  for (const auto& [path, contents] : tree) {
    constexpr std::size_t kFactor = 1'000'003;
    hash = hash * kFactor + std::hash<std::string>()(path);
    hash = hash * kFactor + std::hash<const void*>()(contents.get());
  }
  return hash;
}

}  // namespace

std::vector<DiskModel::Part> DiskModel::parts_of(FileSystem file_system, const Step& step) const {
  const Change& change = changes_[step.index];
  std::vector<Part> parts;
  if (change.kind == ChangeKind::resize) return parts;
  const bool ordered = file_system == FileSystem::ordered;
  for (const std::size_t border : borders(change.number, change.other.size(), ordered ? kBlock : kSector)) {
    parts.push_back({.kind = Part::Kind::first, .amount = border});
    if (!ordered) parts.push_back({.kind = Part::Kind::last, .amount = border});
  }
  if (ordered) return parts;
  parts.push_back({.kind = Part::Kind::size});
  std::minstd_rand random(static_cast<unsigned>(step.index));
  for (int i = 0; i < 2; ++i) parts.push_back({.kind = Part::Kind::some, .amount = random()});
  return parts;
}

void DiskModel::choose_in_order(const Choice& known, std::size_t cut, std::vector<Choice>& all) const {
  std::vector<std::size_t> names;  // that may be lost
  std::vector<std::size_t> bytes;
  for (std::size_t i = 0; i < known.size(); ++i) {
    if (steps_[i].never_lost) continue;
    if (steps_[i].is_of_bytes() && steps_[i].synced >= cut) bytes.push_back(i);
    if (!steps_[i].is_of_bytes() && steps_[i].any_sync >= cut) names.push_back(i);
  }
  std::vector<Choice> of_bytes{known, known};
  for (const std::size_t i : bytes) of_bytes[1][i].kind = Part::Kind::none;
  for (const std::size_t i : bytes) {
    Choice choice = known;
    for (const std::size_t later : bytes)
      if (later > i && steps_[later].of == steps_[i].of) choice[later].kind = Part::Kind::none;
    of_bytes.push_back(choice);
    for (const Part& part : parts_of(FileSystem::ordered, steps_[i])) {
      choice[i] = part;
      of_bytes.push_back(choice);
    }
    choice[i].kind = Part::Kind::none;
    of_bytes.push_back(std::move(choice));
  }
  for (std::size_t kept = 0; kept <= names.size(); ++kept) {
    for (Choice choice : of_bytes) {
      for (std::size_t lost = kept; lost < names.size(); ++lost) choice[names[lost]].kind = Part::Kind::none;
      all.push_back(std::move(choice));
    }
  }
}

void DiskModel::choose_freely(const Choice& known, std::size_t cut, std::vector<Choice>& all) const {
  std::vector<std::size_t> names;
  std::vector<std::size_t> bytes;
  for (std::size_t i = 0; i < known.size(); ++i)
    if (steps_[i].synced >= cut && !steps_[i].never_lost)
      (steps_[i].is_of_bytes() ? bytes : names).push_back(i);
  const auto set = [](Choice choice, const std::vector<std::size_t>& steps, Part::Kind kind) {
    for (const std::size_t i : steps) choice[i].kind = kind;
    return choice;
  };
  std::vector<Choice> of_names{known, set(known, names, Part::Kind::none)};
  for (const std::size_t i : names) {
    of_names.push_back(set(known, {i}, Part::Kind::none));
    of_names.push_back(of_names[1]);
    of_names.back()[i].kind = Part::Kind::all;
  }
  std::minstd_rand random(static_cast<unsigned>(cut));
  for (int i = 0; i < kRandom && names.size() > 2; ++i) {
    of_names.push_back(known);
    for (const std::size_t step : names)
      if (random() % 2 == 0) of_names.back()[step].kind = Part::Kind::none;
  }
  for (std::size_t n = 0; n < of_names.size(); ++n) {
    const Choice& base = of_names[n];
    for (const auto kind : {Part::Kind::all, Part::Kind::none, Part::Kind::size})
      all.push_back(set(base, bytes, kind));
    if (n >= 2) continue;
    for (const std::size_t i : bytes) {
      for (const Part& part : parts_of(FileSystem::weak, steps_[i])) {
        all.push_back(base);
        all.back()[i] = part;
      }
      all.push_back(set(base, {i}, Part::Kind::none));
    }
  }
}

std::vector<DiskModel::Choice> DiskModel::choices(FileSystem file_system, std::size_t cut) const {
  const auto steps = std::ranges::count_if(steps_, [&](const Step& step) { return step.index < cut; });
  const Choice known(static_cast<std::size_t>(steps));
  std::vector<Choice> all;
  if (file_system == FileSystem::ordered) {
    choose_in_order(known, cut, all);
  } else {
    choose_freely(known, cut, all);
  }
  return all;
}

std::string DiskModel::tell(FileSystem file_system, std::size_t cut, const Choice& choice) const {
  std::vector<std::string> lost;
  for (std::size_t i = 0; i < choice.size(); ++i) {
    if (choice[i].kind == Part::Kind::all) continue;
    const std::string what = describe(changes_[steps_[i].index]);
    lost.push_back(choice[i].kind == Part::Kind::none ? what : fmt::format("a part of '{}'", what));
  }
  return fmt::format("{} file system, cut after change {} ({}), lost: {}", to_string(file_system), cut,
                     cut == 0 ? "none" : describe(changes_[cut - 1]),
                     lost.empty() ? "nothing" : fmt::format("{}", fmt::join(lost, "; ")));
}

void DiskModel::for_each_cut(FileSystem file_system,
                             const std::function<void(const CutDisk& disk)>& check) const {
  std::unordered_set<std::size_t> seen;
  std::size_t marks = 0;
  for (std::size_t cut = 0; cut <= changes_.size(); ++cut) {
    // A sync only takes states away; of those that stay the cut before has told.
    const ChangeKind last = cut == 0 ? ChangeKind::mark : changes_[cut - 1].kind;
    if (last == ChangeKind::sync_begin || last == ChangeKind::sync_end) continue;
    if (cut > 0 && last == ChangeKind::mark) ++marks;
    for (const Choice& choice : choices(file_system, cut)) {
      FileTree files = build(choice);
      if (!seen.insert(hash_of(files, marks)).second) continue;
      check({.file_system = file_system,
             .cut = cut,
             .told = tell(file_system, cut, choice),
             .files = std::move(files)});
    }
  }
}

}  // namespace plchost
