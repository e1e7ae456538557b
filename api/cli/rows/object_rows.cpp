#include "api/cli/rows/object_rows.hpp"

#include <algorithm>
#include <span>

#include <fmt/format.h>

#include "api/cli/rows/rows.hpp"

namespace plchost {

namespace {

// A newer host may know more types: their numbers are shown.
std::string type_text(ObjectType type) {
  const ObjectTraits* const traits = traits_of(type);
  return traits != nullptr ? std::string(traits->name) : fmt::format("{}", static_cast<std::uint32_t>(type));
}

std::string holder_text(const ListedObject& mutex) {
  if (mutex.info.value == 0) return "free";
  if (mutex.holder_pid == 0) return fmt::format("held by thread {}, which has ended", mutex.info.value);
  return fmt::format("held by {}({}), thread {}", mutex.holder_program, mutex.holder_pid, mutex.info.value);
}

std::string mode_text(const ObjectInfo& info) {
  return fmt::format("{:04o}", info.mode);
}

Row reference_rows(const ObjectInfo& info) {
  Row rows = Row::array();
  for (const ReferenceInfo& reference : info.references) {
    rows.push_back({{"pid", reference.pid},
                    {"program", reference.program},
                    {"writable", reference.writable},
                    {"waiting", reference.waiting}});
  }
  return rows;
}

constexpr std::size_t kHoldersInTable = 3;

}  // namespace

std::string holders_text(const ObjectInfo& object, std::size_t most) {
  std::string text;
  const std::size_t told = std::min(most, object.references.size());
  for (const ReferenceInfo& reference : std::span(object.references).first(told)) {
    text += fmt::format("{}{}({})", text.empty() ? "" : ", ", reference.program, reference.pid);
  }
  if (object.reference_count > told && told > 0)
    text += fmt::format(" and {} more", object.reference_count - told);
  return text;
}

std::string state_text(const ListedObject& object) {
  const ObjectInfo& info = object.info;
  if (info.type == ObjectType::mutex) return holder_text(object);
  const ObjectTraits* const traits = traits_of(info.type);
  if (traits == nullptr) return fmt::format("value {}", info.value);
  const std::uint64_t number = info.type == ObjectType::memory ? info.size : info.value;
  std::string text = fmt::format(fmt::runtime(traits->value_form), number);
  if (info.type == ObjectType::event) {
    text += fmt::format(", {}registered, {} tasks", info.registered ? "" : "not ", info.bound_tasks);
  }
  return text;
}

Row to_row(std::string_view host, const ListedObject& object) {
  const ObjectInfo& info = object.info;
  const bool event = info.type == ObjectType::event;
  const bool memory = info.type == ObjectType::memory;
  const bool mutex = info.type == ObjectType::mutex;
  const bool held = mutex && info.value != 0;
  const auto or_null = [](bool there, const auto& value) { return there ? Row(value) : Row(); };
  return {{"host", host},
          {"object", info.name},
          {"type", type_text(info.type)},
          {"value", or_null(!memory && !mutex, info.value)},
          {"size_bytes", or_null(memory, info.size)},
          {"held", or_null(mutex, held)},
          {"holder_thread", or_null(held, info.value)},
          {"holder_pid", or_null(held && object.holder_pid != 0, object.holder_pid)},
          {"holder_program", or_null(held && object.holder_pid != 0, object.holder_program)},
          {"registered", or_null(event, info.registered)},
          {"bound_tasks", or_null(event, info.bound_tasks)},
          {"waiters", info.waiters},
          {"kept", info.kept},
          {"owner", info.owner},
          {"owner_name", or_null(!object.owner_name.empty(), object.owner_name)},
          {"group", info.group},
          {"group_name", or_null(!object.group_name.empty(), object.group_name)},
          {"mode", mode_text(info)},
          {"made", time_text(info.made_unix_ns)},
          {"reference_count", info.reference_count},
          {"references", reference_rows(info)}};
}

Row to_short_row(std::string_view host, const ListedObject& object) {
  const ObjectInfo& info = object.info;
  const bool memory = info.type == ObjectType::memory;
  Row row{{"host", host}, {"object", info.name}, {"type", type_text(info.type)}};
  row["size"] = memory ? Row(info.size) : Row();
  if (info.type == ObjectType::mutex) {
    row["value"] = holder_text(object);
  } else if (!memory) {
    row["value"] = info.value;
  }
  row["waiters"] = info.waiters;
  row["references"] = info.reference_count;
  row["by"] = holders_text(info, kHoldersInTable);
  return row;
}

const std::vector<Column>& object_columns() {
  static const std::vector<Column> columns{{.field = "host", .header = "HOST", .rank = 1},
                                           {.field = "object", .header = "OBJECT"},
                                           {.field = "type", .header = "TYPE", .rank = 2},
                                           {.field = "size", .header = "SIZE", .rank = 3},
                                           {.field = "value", .header = "VALUE"},
                                           {.field = "waiters", .header = "WAITERS", .rank = 4},
                                           {.field = "references", .header = "REFS", .rank = 5},
                                           {.field = "by", .header = "BY", .rank = 6}};
  return columns;
}

std::string format_object(std::string_view host, const ListedObject& object) {
  const Row row = to_row(host, object);
  Row said;
  for (const auto& [field, value] : row.items()) {
    if (!value.is_null() && field != "references") said[field] = value;
  }
  std::string text = format_fields(said);
  const Row references = reference_rows(object.info);
  if (references.empty()) return text;
  const std::vector<Row> rows(references.begin(), references.end());
  text += "\n" +
          format_table(
              rows, {{"pid", "PID"}, {"program", "PROGRAM"}, {"writable", "WRITES"}, {"waiting", "WAITING"}});
  if (object.info.reference_count > rows.size()) {
    text += fmt::format("and {} more\n", object.info.reference_count - rows.size());
  }
  return text;
}

}  // namespace plchost
