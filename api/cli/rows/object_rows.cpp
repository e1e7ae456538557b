#include "api/cli/rows/object_rows.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "api/cli/rows/rows.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

// A newer host may know more types: their numbers and values are shown.
std::string type_text(const plc_ObjectRecord& object) {
  return dds::word_for(dds::words::ObjectRecord::type, object.type);
}

const ObjectTraits& shown_as(const ListedObject& object) {
  static constexpr ObjectTraits kUnknown{};
  const ObjectTraits* const traits = traits_of(object.type());
  return traits != nullptr ? *traits : kUnknown;
}

std::string holder_text(const plc_ObjectRecord& mutex) {
  if (mutex.value == 0) return "free";
  if (mutex.holder_pid == 0 && mutex.holder_program[0] == '\0') {
    return fmt::format("held by thread {}, which has ended", mutex.value);
  }
  if (mutex.holder_pid == 0) {
    return fmt::format("held by {} of another container, thread {} there", dds::text_of(mutex.holder_program),
                       mutex.value);
  }
  return fmt::format("held by {}({}), thread {}", dds::text_of(mutex.holder_program), mutex.holder_pid,
                     mutex.value);
}

Row reference_rows(const std::vector<plc_ObjectReference>& references) {
  Row rows = Row::array();
  for (const plc_ObjectReference& reference : references) rows.push_back(to_row(reference));
  return rows;
}

constexpr std::size_t kHoldersInTable = 3;

}  // namespace

std::string holders_text(const ListedObject& object, std::size_t most) {
  std::string text;
  const std::size_t told = std::min(most, object.references.size());
  for (const plc_ObjectReference& reference : std::span(object.references).first(told)) {
    text += text.empty() ? "" : ", ";
    text += reference.pid == 0 ? fmt::format("{}(of another container)", dds::text_of(reference.program))
                               : fmt::format("{}({})", dds::text_of(reference.program), reference.pid);
  }
  const std::uint32_t all = object.record.reference_count;
  if (all > told && told > 0) text += fmt::format(" and {} more", all - told);
  return text;
}

std::string state_text(const ListedObject& object) {
  const plc_ObjectRecord& record = object.record;
  const ObjectTraits& traits = shown_as(object);
  if (traits.has_holder) return holder_text(record);
  std::string text =
      fmt::format(fmt::runtime(traits.value_form), traits.has_size ? record.size : record.value);
  if (traits.has_tasks) {
    text += fmt::format(", {}registered, {}", record.registered ? "" : "not ",
                        count_text(record.bound_tasks, "task"));
  }
  return text;
}

dds::Computed<plc_ObjectRecord, Row> computed_of(const plc_ObjectRecord& object, std::string_view host,
                                                 const ListedObject& listed) {
  const ObjectTraits& traits = shown_as(listed);
  const bool held = traits.has_holder && object.value != 0;
  const auto or_null = [](bool there, const auto& value) { return there ? Row(value) : Row(); };
  return {.host = host,
          .value = or_null(!traits.has_holder && !traits.has_size, object.value),
          .held = or_null(traits.has_holder, held),
          .holder_thread = or_null(held, object.value),
          .registered = or_null(traits.has_tasks, object.registered),
          .bound_tasks = or_null(traits.has_tasks, object.bound_tasks),
          .mode = fmt::format("{:04o}", object.mode),
          .references = reference_rows(listed.references)};
}

Row to_row(std::string_view host, const ListedObject& object) {
  return to_row(object.record.record(), host, object);
}

Row to_short_row(std::string_view host, const ListedObject& object) {
  const plc_ObjectRecord& record = object.record;
  const ObjectTraits& traits = shown_as(object);
  Row row{{"host", host}, {"object", object.name()}, {"type", type_text(record)}};
  row["size"] = traits.has_size ? Row(record.size) : Row();
  if (traits.has_holder) {
    row["value"] = holder_text(record);
  } else if (!traits.has_size) {
    row["value"] = record.value;
  }
  row["waiters"] = record.waiters;
  row["references"] = record.reference_count;
  row["by"] = holders_text(object, kHoldersInTable);
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
  if (object.references.empty()) return text;
  std::vector<Row> rows;
  for (const plc_ObjectReference& reference : object.references) rows.push_back(to_row(reference));
  text += "\n" + format_table(rows, columns_of<plc_ObjectReference>());
  if (object.record.reference_count > rows.size()) {
    text += fmt::format("and {} more\n", object.record.reference_count - rows.size());
  }
  return text;
}

}  // namespace plchost
