#include "api/library/python/types.hpp"

#include <array>
#include <chrono>
#include <cstddef>
#include <exception>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <code_words.hpp>
#include <library_members.hpp>

namespace plchost::python {

namespace {

double seconds(std::chrono::nanoseconds duration) {
  return std::chrono::duration<double>(duration).count();
}

template <class Item>
auto member_seconds(std::chrono::nanoseconds Item::* member) {
  return [member](const Item& item) { return seconds(item.*member); };
}

// Members of Python: durations are seconds, texts of hosts are cut at their bounds, and no name is a word of
// the language.
struct MemberToPython : ToPython {
  using ToPython::operator();
  py::object operator()(std::chrono::nanoseconds duration) const { return py::float_(seconds(duration)); }
  template <std::size_t N>
  py::object operator()(const std::array<std::chrono::nanoseconds, N>& durations) const {
    py::list all;
    for (const auto duration : durations) all.append((*this)(duration));
    return all;
  }
  py::object operator()(const std::vector<std::string>& texts) const {
    py::list all;
    for (const auto& text : texts) all.append((*this)(text));
    return all;
  }
};

std::string python_name(const std::string& name) {
  const bool is_word = py::module_::import("keyword").attr("iskeyword")(name).cast<bool>();
  return is_word ? name + "_" : name;
}

/// The members that the contract has. `Type` is `Base`, or has more than that.
template <class Base, class Type>
void define_members(py::class_<Type>& type) {
  plchost::client_types::visit_members(
      std::type_identity<Base>(), [&](const char* name, auto member, const char* text) {
        type.def_property_readonly(
            python_name(name).c_str(),
            [member](const Type& item) -> py::object { return MemberToPython()(item.*member); }, text);
      });
}

void define_states(py::module_& module) {
  plchost::client_types::visit_types(
      [&]<class Type>(const char* name, std::type_identity<Type> /*type*/, const char* text) {
        py::class_<Type> made(module, name, text);
        define_members<Type>(made);
      });
  py::class_<Client::Host> host(module, "Host", "A host.");
  define_members<plchost::client_types::Host>(host);
  host.def_readonly("answers", &Client::Host::answers).def_readonly("instances", &Client::Host::instances);
  py::class_<Client::Transition> transition(module, "Transition", "A change of state.");
  define_members<plchost::client_types::Transition>(transition);
  transition.def_readonly("missed", &Client::Transition::missed);
  py::class_<Client::LogLine> line(module, "LogLine", "A line that an instance has said.");
  define_members<plchost::client_types::LogLine>(line);
  line.def_readonly("host", &Client::LogLine::host)
      .def_readonly("instance", &Client::LogLine::instance)
      .def_readonly("missing", &Client::LogLine::missing)
      .def_readonly("stream", &Client::LogLine::stream);
}

void define_results(py::module_& module) {
  py::class_<Client::Sample>(module, "Sample",
                             "Variables of an application, with their values of one moment.")
      .def_readonly("time", &Client::Sample::time)
      .def_readonly("consistent", &Client::Sample::consistent)
      .def_readonly("variables", &Client::Sample::variables);
  py::class_<Client::Force, plchost::client_types::Variable>(module, "Force", "A variable that is forced.")
      .def_readonly("host", &Client::Force::host)
      .def_readonly("instance", &Client::Force::instance);
  py::class_<Client::Sampled>(module, "Sampled",
                              "A sample of a watch of variables, or why there is none: code, text.")
      .def_readonly("code", &Client::Sampled::code)
      .def_readonly("text", &Client::Sampled::text)
      .def_readonly("sample", &Client::Sampled::sample)
      .def("__bool__", [](const Client::Sampled& sampled) { return static_cast<bool>(sampled); });
  py::class_<Client::Clock>(module, "Clock", "The clock of a host, as seen from here.")
      .def_property_readonly("offset", member_seconds(&Client::Clock::offset))
      .def_property_readonly("uncertainty", member_seconds(&Client::Clock::uncertainty));
  py::class_<Client::Posted>(module, "Posted")
      .def_readonly("accepted", &Client::Posted::accepted)
      .def_readonly("no_task", &Client::Posted::no_task);
  py::class_<Client::Outcome>(module, "Outcome")
      .def_readonly("code", &Client::Outcome::code)
      .def_readonly("text", &Client::Outcome::text)
      .def_readonly("posted", &Client::Outcome::posted)
      .def("__bool__", [](const Client::Outcome& outcome) { return static_cast<bool>(outcome); });
  py::class_<Client::Run>(module, "Run")
      .def_readonly("tasks", &Client::Run::tasks)
      .def_readonly("last_task", &Client::Run::last_task)
      .def_property_readonly("to_start", member_seconds(&Client::Run::to_start))
      .def_property_readonly("to_end", member_seconds(&Client::Run::to_end))
      .def_property_readonly("round_trip", member_seconds(&Client::Run::round_trip));
  py::class_<Client::Watch, Holder<Client::Watch>>(module, "Watch",
                                                   "Calls back until stop(), or the end of its `with`.")
      .def("stop", &Client::Watch::stop, NoGil())
      .def("__enter__", [](Client::Watch& watch) -> Client::Watch& { return watch; })
      .def("__exit__", [](Client::Watch& watch, const py::args&) {
        const py::gil_scoped_release release;
        watch.stop();
      });
}

// ClientError with its code, which pybind11's own way of exceptions has no place for, and the codes by their
// names: ClientError.not_found.
void define_error(py::module_& module) {
  static const py::handle type =
      py::exception<ClientError>(module, "ClientError", PyExc_RuntimeError).release();
  const auto& words = plchost::dds::words::Reply::code;
  for (std::size_t code = 1; code < words.size(); ++code) type.attr(std::string(words[code]).c_str()) = code;
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(std::move(thrown));
    } catch (const ClientError& error) {
      py::object raised = py::reinterpret_borrow<py::object>(type)(error.what());
      raised.attr("code") = error.code();
      PyErr_SetObject(type.ptr(), raised.ptr());
    }
  });
}

}  // namespace

void define_types(py::module_& module) {
  define_error(module);
  define_states(module);
  define_results(module);
}

}  // namespace plchost::python
