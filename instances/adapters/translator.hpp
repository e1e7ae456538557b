#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "instances/adapters/build_context.hpp"
#include "instances/adapters/iec/compiler.hpp"
#include "instances/adapters/iec/glue.hpp"
#include "instances/adapters/iec/project.hpp"

namespace plchost {

/// The part of a build that knows a compiler. The functions are called in this order. False: why not is in
/// the context's report.
class Translator {
 public:
  virtual ~Translator() = default;

  [[nodiscard]] virtual iec::Compiler compiler() const noexcept = 0;
  /// Fills the project of the context.
  virtual bool read() = 0;
  /// After the project was planned without a problem.
  virtual bool translate() = 0;
  [[nodiscard]] virtual iec::Glue glue(const iec::Resource& resource) = 0;
  /// Compiles the glue of a resource, in a new file of that name, to an application.
  virtual bool compile(const std::string& name, const std::string& glue,
                       const std::filesystem::path& made) = 0;
};

[[nodiscard]] std::unique_ptr<Translator> make_matiec_translator(BuildContext& context);
[[nodiscard]] std::unique_ptr<Translator> make_strucpp_translator(BuildContext& context);

/// The translator of the compiler that the order names, or else that is there. None: why not is in the
/// context's report.
[[nodiscard]] std::unique_ptr<Translator> choose_translator(BuildContext& context);

}  // namespace plchost
