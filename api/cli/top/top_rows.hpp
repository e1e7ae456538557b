#pragma once

#include <string>
#include <vector>

#include "api/cli/rows/table.hpp"
#include "api/cli/top/plant_look.hpp"
#include "api/cli/top/top_figures.hpp"

namespace plchost {

/// How trends are drawn in rows.
struct TrendStyle {
  std::size_t width = 16;
  bool unicode = true;
};

/// A table of plcctl top. The first field of each row, "name", tells the row from all others. The columns say
/// what is shown.
struct TopTable {
  std::vector<Row> rows;
  std::vector<Column> columns;
};

[[nodiscard]] TopTable instance_table(const std::vector<HostLook>& hosts, const TopFigures& figures,
                                      const TrendStyle& style);
/// `instance`: "host/instance"; empty: the tasks of all.
[[nodiscard]] TopTable task_table(const std::vector<HostLook>& hosts, const TopFigures& figures,
                                  const TrendStyle& style, const std::string& instance = {});
/// The cores of instances that have one, and what runs there.
[[nodiscard]] TopTable core_table(const std::vector<HostLook>& hosts, const TopFigures& figures,
                                  const TrendStyle& style);
/// The last losses of cycles of one instance with their causes, the newest first.
[[nodiscard]] TopTable loss_table(const std::vector<HostLook>& hosts, const std::string& instance);
/// Its last exception in one line; empty: it had none.
[[nodiscard]] std::string exception_line(const std::vector<HostLook>& hosts, const std::string& instance);

}  // namespace plchost
