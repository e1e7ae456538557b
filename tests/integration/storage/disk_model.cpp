#include "tests/integration/storage/disk_model.hpp"

#include <algorithm>
#include <ranges>

#include <fmt/format.h>

#include "shm/base/result.hpp"

namespace plchost {

std::string_view to_string(FileSystem file_system) noexcept {
  return file_system == FileSystem::ordered ? "ordered" : "weak";
}

Result<DiskModel> DiskModel::make(std::vector<Change> changes, const std::string& top) {
  DiskModel model;
  model.changes_ = std::move(changes);
  model.top_ = top;
  for (std::size_t i = 0; i < model.changes_.size(); ++i) PLCHOST_TRY(model.add(i));
  model.find_syncs();
  model.find_sights();
  return model;
}

std::optional<std::pair<DiskModel::Id, std::string>> DiskModel::place(std::string_view path) const {
  if (!path.starts_with(top_)) return std::nullopt;
  std::pair<Id, std::string> found{kTop, ""};
  for (const auto& each : path.substr(top_.size()) | std::views::split('/')) {
    const std::string name(each.begin(), each.end());
    if (name.empty() || name == ".") continue;
    if (!found.second.empty()) {
      const auto& names = now_.folders.at(found.first);
      const auto next = names.find(found.second);
      if (next == names.end() || !now_.folders.contains(next->second)) return std::nullopt;
      found.first = next->second;
    }
    found.second = name;
  }
  return found;
}

Result<void> DiskModel::add(std::size_t index) {
  const Change& change = changes_[index];
  const auto unexplained = [&] {
    return failure(ErrorCode::corrupt,
                   fmt::format("change {}: {}: nothing recorded leads there", index, describe(change)));
  };
  Step step;
  step.index = index;
  step.kind = change.kind;
  switch (change.kind) {
    case ChangeKind::mark:
    case ChangeKind::sync_begin:
    case ChangeKind::sync_end:
      return {};
    case ChangeKind::unknown:
      return unexplained();
    case ChangeKind::write:
    case ChangeKind::resize: {
      const auto file = known_.find(change.inode);
      if (file == known_.end()) return unexplained();
      step.of = step.what = file->second;
      break;
    }
    case ChangeKind::create:
    case ChangeKind::make_folder:
      step.what = known_[change.inode] = ++last_;
      [[fallthrough]];
    case ChangeKind::rename:
    case ChangeKind::exchange:
    case ChangeKind::link:
    case ChangeKind::remove:
    case ChangeKind::remove_folder:
      return add_name(std::move(step), change);
  }
  steps_.push_back(step);
  apply(steps_.size() - 1, {}, now_);
  return {};
}

Result<void> DiskModel::add_name(Step step, const Change& change) {
  const auto at = place(change.path);
  const auto to = Step::has_two_names(change.kind) ? place(change.other) : at;
  if (!at || !to || at->second.empty() || to->second.empty())
    return failure(ErrorCode::corrupt, describe(change) + ": its folder was never made");
  step.of = at->first;
  step.name = at->second;
  step.to = to->first;
  step.new_name = to->second;
  if (step.what == kTop) {
    const auto& names = now_.folders.at(step.of);
    const auto what = names.find(step.name);
    if (what == names.end()) return failure(ErrorCode::corrupt, describe(change) + ": it was never made");
    step.what = what->second;
  }
  if (step.kind == ChangeKind::exchange) step.other = now_.folders.at(step.to).at(step.new_name);
  steps_.push_back(step);
  apply(steps_.size() - 1, {}, now_);
  return {};
}

void DiskModel::find_syncs() {
  struct Sync {
    std::size_t begin = 0;
    std::size_t end = 0;
    Id of = kTop;
  };
  std::map<std::uint64_t, std::size_t> begun;  // by number
  std::map<std::uint64_t, Id> known;           // by inode, at that time
  std::vector<Sync> syncs;
  auto step = steps_.begin();
  for (std::size_t i = 0; i < changes_.size(); ++i) {
    const Change& change = changes_[i];
    if (step != steps_.end() && step->index == i) {
      if (change.inode != 0) known[change.inode] = step->what;
      ++step;
    }
    if (change.kind == ChangeKind::sync_begin) begun[change.number] = i;
    if (change.kind != ChangeKind::sync_end || !begun.contains(change.number)) continue;
    const auto of = known.find(change.inode);
    if (of == known.end() && change.path != top_) continue;  // of what was there before
    syncs.push_back({.begin = begun[change.number], .end = i, .of = of == known.end() ? kTop : of->second});
  }
  for (Step& each : steps_) {
    each.never_lost = changes_[each.index].path.contains(kUnimportant);
    const auto first = [&](const auto& is_of) {
      std::size_t end = kNever;
      for (const Sync& sync : syncs)
        if (sync.begin > each.index && is_of(sync.of)) end = std::min(end, sync.end);
      return end;
    };
    const auto own = first([&](Id of) { return of == each.of; });
    const auto of_new = [&] { return first([&](Id of) { return of == each.to; }); };
    each.synced = each.kind == ChangeKind::link    ? of_new()
                  : Step::has_two_names(each.kind) ? std::max(own, of_new())
                                                   : own;
    each.any_sync = first([](Id) { return true; });
  }
}

void DiskModel::find_sights() {
  Nodes nodes;
  FileTree before;
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    apply(i, {}, nodes);
    FileTree after;
    list(nodes, kTop, top_, after);
    const std::size_t since = steps_[i].index + 1;
    for (const auto& [path, contents] : after) {
      const auto known = before.find(path);
      if (contents && (known == before.end() || known->second != contents))
        sights_[path].push_back({.since = since, .contents = contents});
    }
    for (const auto& [path, contents] : before)
      if (contents && !after.contains(path)) sights_[path].push_back({.since = since, .contents = nullptr});
    before = std::move(after);
  }
}

void DiskModel::apply(std::size_t index, const Part& part, Nodes& nodes) const {
  const Step& step = steps_[index];
  if (part.kind == Part::Kind::none) return;
  if (step.is_of_bytes()) {
    nodes.files[step.of].emplace_back(index, part);
    return;
  }
  auto& names = nodes.folders[step.of];
  const auto has_it = [&] {
    const auto at = names.find(step.name);
    return at != names.end() && at->second == step.what;
  };
  if (step.kind == ChangeKind::make_folder) (void)nodes.folders[step.what];
  if (step.kind == ChangeKind::create || step.kind == ChangeKind::make_folder) {
    names[step.name] = step.what;
  } else if (step.kind == ChangeKind::exchange) {
    names[step.name] = step.other;
    nodes.folders[step.to][step.new_name] = step.what;
  } else if (step.kind == ChangeKind::link) {
    nodes.folders[step.to][step.new_name] = step.what;
  } else {
    if (has_it()) names.erase(step.name);
    if (step.kind == ChangeKind::rename) nodes.folders[step.to][step.new_name] = step.what;
  }
}

DiskModel::Bytes DiskModel::bytes_of(const std::vector<std::pair<std::size_t, Part>>& parts) const {
  std::string key;
  for (const auto& [step, part] : parts)
    key += fmt::format("{}:{}:{} ", step, static_cast<int>(part.kind), part.amount);
  if (const auto made = made_.find(key); made != made_.end()) return made->second;
  constexpr std::size_t kBytesOfSector = 512;
  std::string bytes;
  for (const auto& [step, part] : parts) {
    const Change& change = changes_[steps_[step].index];
    if (change.kind == ChangeKind::resize) {
      bytes.resize(change.number);
      continue;
    }
    const std::size_t size = part.kind == Part::Kind::first ? part.amount : change.other.size();
    if (bytes.size() < change.number + size) bytes.resize(change.number + size);
    for (std::size_t at = 0; at < size;) {
      const std::size_t border =
          (change.number + at) / kBytesOfSector * kBytesOfSector + kBytesOfSector - change.number;
      const std::size_t end = std::min(size, border);
      const std::size_t sector = (change.number + at) / kBytesOfSector;
      const bool there = part.kind == Part::Kind::all || part.kind == Part::Kind::first ||
                         (part.kind == Part::Kind::last && at >= part.amount) ||
                         (part.kind == Part::Kind::some && (part.amount >> sector % 16U & 1U) != 0);
      if (there) bytes.replace(change.number + at, end - at, change.other, at, end - at);
      at = end;
    }
  }
  const auto [same, fresh] = contents_.try_emplace(bytes, nullptr);
  if (fresh) same->second = std::make_shared<const std::string>(std::move(bytes));
  return made_[key] = same->second;
}

void DiskModel::list(const Nodes& nodes, Id folder, const std::string& path, FileTree& tree) const {
  static const std::vector<std::pair<std::size_t, Part>> kEmpty;
  for (const auto& [name, id] : nodes.folders.at(folder)) {
    const std::string at = path + "/" + name;
    if (nodes.folders.contains(id)) {
      tree[at] = nullptr;
      list(nodes, id, at, tree);
    } else {
      const auto file = nodes.files.find(id);
      tree[at] = bytes_of(file == nodes.files.end() ? kEmpty : file->second);
    }
  }
}

FileTree DiskModel::build(const Choice& choice) const {
  Nodes nodes;
  // Folders that were made are there as such, if anything leads to them.
  for (std::size_t i = 0; i < choice.size(); ++i)
    if (steps_[i].kind == ChangeKind::make_folder) (void)nodes.folders[steps_[i].what];
  for (std::size_t i = 0; i < choice.size(); ++i) apply(i, choice[i], nodes);
  FileTree tree;
  list(nodes, kTop, top_, tree);
  return tree;
}

FileTree DiskModel::live(std::size_t changes) const {
  const auto steps = std::ranges::count_if(steps_, [&](const Step& step) { return step.index < changes; });
  return build(Choice(static_cast<std::size_t>(steps)));
}

std::size_t DiskModel::promised(std::string_view path, std::size_t cut) const {
  constexpr std::string_view kKept = "kept ";
  for (std::size_t i = std::min(cut, changes_.size()); i-- > 0;) {
    const Change& change = changes_[i];
    if (change.kind != ChangeKind::mark || !change.path.starts_with(kKept)) continue;
    const std::string_view what = std::string_view(change.path).substr(kKept.size());
    if (what == "all" || path.contains(what)) return i;
  }
  return 0;
}

DiskModel::Bytes DiskModel::seen(const std::string& path, std::size_t changes) const {
  const auto found = sights_.find(path);
  Bytes last;
  if (found == sights_.end()) return last;
  for (const Sight& sight : found->second)
    if (sight.since <= changes) last = sight.contents;
  return last;
}

bool DiskModel::was_seen(const std::string& path, const Bytes& contents, std::size_t first,
                         std::size_t cut) const {
  const auto same = [&](const Bytes& other) {
    return contents == other || (contents && other && *contents == *other);
  };
  if (same(seen(path, first))) return true;
  const auto found = sights_.find(path);
  return found != sights_.end() && std::ranges::any_of(found->second, [&](const Sight& sight) {
           return sight.since > first && sight.since <= cut && same(sight.contents);
         });
}

std::set<std::string> DiskModel::paths() const {
  std::set<std::string> all;
  for (const auto& [path, sights] : sights_) all.insert(path);
  return all;
}

}  // namespace plchost
