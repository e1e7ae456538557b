// The client library for Python: module plchost_client. Names are those of plchost_client.hpp; times are
// floats in seconds, wall-clock times are datetime. Calls let other threads of Python run; callbacks come on
// a thread of the library.
#include <algorithm>
#include <array>
#include <cstddef>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <code_words.hpp>
#include <library_members.hpp>
#include <pybind11/chrono.h>
#include <pybind11/functional.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "api/plchost_client.hpp"

namespace py = pybind11;
using plchost::Client;
using plchost::ClientError;
using plchost::LoadOptions;

namespace {

/// Texts of hosts are cut at their bounds, also within a character: that must not cost the whole list.
struct ToPython {
  py::object operator()(const std::string& text) const {
    return py::reinterpret_steal<py::object>(
        PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()), "replace"));
  }
  template <class Number>
  py::object operator()(Number number) const {
    return py::cast(number);
  }
};

using NoGil = py::call_guard<py::gil_scoped_release>;

// Those that are there. When Python ends they are closed before: a thread that waits for Python then would be
// ended where it stands.
class Clients {
 public:
  void add(Client* client) {
    const std::lock_guard lock(mutex_);
    clients_.insert(client);
  }
  void remove(Client* client) {
    const std::lock_guard lock(mutex_);
    clients_.erase(client);
  }
  void close() {
    const std::lock_guard lock(mutex_);
    for (Client* client : clients_) client->close();
  }

 private:
  std::mutex mutex_;
  std::set<Client*> clients_;
};

Clients& clients() {
  static Clients all;
  return all;
}

// A destructor that waits for a callback must let that callback have Python.
struct DeleteWithoutGil {
  template <class T>
  void operator()(T* object) const {
    const py::gil_scoped_release release;
    if constexpr (std::is_same_v<T, Client>) clients().remove(object);
    delete object;
  }
};
template <class T>
using Holder = std::unique_ptr<T, DeleteWithoutGil>;

double seconds(std::chrono::nanoseconds duration) {
  return std::chrono::duration<double>(duration).count();
}

py::dict dict_of(const Client::Record& record) {
  py::dict members;
  for (const auto& [name, value] : record) members[name.c_str()] = std::visit(ToPython(), value);
  return members;
}

template <class Item>
const Item& to_argument(const Item& item) {
  return item;  // NOLINT(bugprone-return-const-ref-from-parameter): within the call that it is an argument of
}
py::dict to_argument(const Client::Record& record) {
  return dict_of(record);
}

// An exception of a callback has no receiver: Python writes it to stderr, as for threads.
template <class Item>
std::function<void(const Item&)> guarded(py::function callback) {
  // The last reference may go on a thread of the library.
  const std::shared_ptr<py::function> kept(new py::function(std::move(callback)), [](py::function* function) {
    const py::gil_scoped_acquire gil;
    delete function;
  });
  return [kept](const Item& item) {
    const py::gil_scoped_acquire gil;
    try {
      (*kept)(to_argument(item));
    } catch (py::error_already_set& raised) {
      raised.discard_as_unraisable("a callback of plchost_client");
    }
  };
}

using Progress = std::optional<py::function>;
Client::Progress told_progress(const Progress& progress) {
  if (!progress) return {};
  return [told = guarded<unsigned long long>(*progress)](unsigned long long bytes) { told(bytes); };
}

template <class Item>
Client::Watch begin(Client& client,
                    Client::Watch (Client::*watch)(const std::string&, std::function<void(const Item&)>),
                    const std::string& host, py::function callback) {
  return (client.*watch)(host, guarded<Item>(std::move(callback)));
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

Client::Options options_of(unsigned domain, std::vector<std::string> interfaces,
                           std::vector<std::string> peers, std::string identity, double timeout,
                           std::string host) {
  constexpr double kPerSecond = 1000;
  constexpr double kMost = 1e9;
  const double ms = timeout > 0 && timeout < kMost ? timeout * kPerSecond : 0;  // 0 is refused with a text
  return {.domain = domain,
          .interfaces = std::move(interfaces),
          .peers = std::move(peers),
          .identity = std::move(identity),
          .timeout = std::chrono::milliseconds(static_cast<std::int64_t>(ms)),
          .host = std::move(host)};
}

using ClientClass = py::class_<Client, Holder<Client>>;

void define_calls(ClientClass& client) {
  client.def("close", &Client::close, NoGil())
      .def("__enter__", [](Client& self) -> Client& { return self; })
      .def("__exit__",
           [](Client& self, const py::args&) {
             const py::gil_scoped_release release;
             self.close();
           })
      .def("hosts", &Client::hosts, NoGil())
      .def("instances", &Client::instances, py::arg("host") = "", NoGil())
      .def("tasks", &Client::tasks, py::arg("host") = "", NoGil())
      .def("events", &Client::events, py::arg("host") = "", NoGil())
      .def("applications", &Client::applications, py::arg("host") = "", NoGil())
      .def("exceptions", &Client::exceptions, py::arg("host") = "", NoGil())
      .def("writers", &Client::writers, py::arg("host") = "", NoGil())
      .def("objects", &Client::objects, py::arg("host") = "", py::arg("pattern") = "",
           "The objects of the pool whose names match: '*' any characters, '?' one.", NoGil())
      .def("nodes", &Client::nodes, py::arg("host") = "", py::arg("base") = "",
           "The nodes that send each other blocks.", NoGil())
      .def("routes", &Client::routes, py::arg("host") = "", py::arg("base") = "",
           "How blocks go from one node to another, or to other hosts.", NoGil())
      .def("variables", &Client::variables, py::arg("host"), py::arg("instance"),
           py::arg("patterns") = std::vector<std::string>(), NoGil())
      .def("sample", &Client::sample, py::arg("host"), py::arg("instance"), py::arg("patterns"), NoGil())
      .def("check_host", &Client::check_host, py::arg("host") = "",
           "Has the host looked at anew. Returns the result of each check.", NoGil())
      .def("read_clock", &Client::read_clock, py::arg("host") = "", NoGil())
      .def("statistics", &Client::statistics, py::arg("host"), py::arg("instance"), py::arg("task"), NoGil())
      .def("logs",
           py::overload_cast<const std::string&, const std::string&, unsigned long long>(&Client::logs),
           py::arg("host"), py::arg("instance"), py::arg("newest") = ~0ULL,
           "The lines of an instance, oldest first: the newest lines of those that the host keeps.", NoGil())
      .def("logs",
           py::overload_cast<const std::string&, const std::string&, const Client::LogLine&>(&Client::logs),
           py::arg("host"), py::arg("instance"), py::arg("after"),
           "The lines after one that logs() has returned before, to read on.", NoGil())
      .def("post",
           py::overload_cast<const std::string&, const std::string&, unsigned long long>(&Client::post),
           py::arg("host"), py::arg("event"), py::arg("count") = 1, NoGil())
      .def(
          "post_and_tell",
          [](Client& self, const std::string& host, const std::string& event, py::function done) {
            self.post(host, event, guarded<Client::Outcome>(std::move(done)));
          },
          py::arg("host"), py::arg("event"), py::arg("done"),
          "Returns at once; done(outcome) is called once.")
      .def("post_all", &Client::post_all, py::arg("host"), py::arg("events"), NoGil())
      .def("post_and_wait", &Client::post_and_wait, py::arg("host"), py::arg("event"), NoGil())
      .def("reset", &Client::reset, py::arg("host"), py::arg("instance"), py::arg("cold") = false, NoGil())
      .def("register_event", &Client::register_event, py::arg("host"), py::arg("event"), NoGil())
      .def("unregister_event", &Client::unregister_event, py::arg("host"), py::arg("event"), NoGil())
      .def("reload", &Client::reload, py::arg("host") = "",
           "Has the host read its configuration file again. Returns a line for each change; a faulty file "
           "changes nothing and raises ClientError with a line for each error.",
           NoGil());
}

/// A method for a command of the table.
void define_command(ClientClass& client, const std::string& method, const Client::Operation& operation) {
  const std::string& name = operation.name;
  const char* const argument = operation.argument.c_str();
  if (!operation.names_instance) {
    client.def(
        method.c_str(), [name](Client& self, const std::string& host) { return self.command(name, host); },
        py::arg("host") = "", operation.help.c_str(), NoGil());
  } else if (operation.loads && operation.argument.empty()) {
    client.def(
        method.c_str(),
        [name](Client& self, const std::string& host, const std::string& instance, bool boot, bool online) {
          return self.command(name, host, instance, {}, LoadOptions{boot, online});
        },
        py::arg("host"), py::arg("instance"), py::arg("boot") = false, py::arg("online") = false,
        operation.help.c_str(), NoGil());
  } else if (operation.loads) {
    client.def(
        method.c_str(),
        [name](Client& self, const std::string& host, const std::string& instance, const std::string& given,
               bool boot,
               bool online) { return self.command(name, host, instance, given, LoadOptions{boot, online}); },
        py::arg("host"), py::arg("instance"), py::arg(argument), py::arg("boot") = false,
        py::arg("online") = false, operation.help.c_str(), NoGil());
  } else if (operation.argument.empty()) {
    client.def(
        method.c_str(),
        [name](Client& self, const std::string& host, const std::string& instance) {
          return self.command(name, host, instance);
        },
        py::arg("host"), py::arg("instance"), operation.help.c_str(), NoGil());
  } else {
    auto run = [name](Client& self, const std::string& host, const std::string& instance,
                      const std::string& given) { return self.command(name, host, instance, given); };
    const auto define = [&](const auto& last) {
      client.def(method.c_str(), run, py::arg("host"), py::arg("instance"), last, operation.help.c_str(),
                 NoGil());
    };
    if (operation.may_be_left_out) {
      define(py::arg(argument) = "");
    } else {
      define(py::arg(argument));
    }
  }
}

/// An application that is sent, and commands that have no function of their own above, as "reset_statistics":
/// all of the table.
void define_commands(ClientClass& client) {
  client
      .def(
          "download_application",
          [](Client& self, const std::string& host, const std::string& instance, const std::string& file,
             bool boot, bool online, const Progress& progress) {
            const auto told = told_progress(progress);
            const py::gil_scoped_release release;
            return self.download_application(host, instance, file, LoadOptions{boot, online}, told);
          },
          py::arg("host"), py::arg("instance"), py::arg("file"), py::arg("boot") = false,
          py::arg("online") = false, py::arg("progress") = py::none(),
          "Sends a file of this machine to the instance, which loads it. progress(bytes): so many have "
          "arrived.")
      .def(
          "download_and_tell",
          [](Client& self, const std::string& host, const std::string& instance, const std::string& file,
             py::function done, bool boot, bool online, const Progress& progress) {
            self.download_application(host, instance, file, LoadOptions{boot, online},
                                      told_progress(progress), guarded<Client::Outcome>(std::move(done)));
          },
          py::arg("host"), py::arg("instance"), py::arg("file"), py::arg("done"), py::arg("boot") = false,
          py::arg("online") = false, py::arg("progress") = py::none(),
          "Returns at once; done(outcome) is called once.");
  client.def_static("topics", &Client::topics)
      .def(
          "status",
          [](Client& self, const std::string& topic, const std::string& host) {
            std::vector<Client::Record> records;
            {
              const py::gil_scoped_release release;
              records = self.status(topic, host);
            }
            py::list all;
            for (const Client::Record& record : records) all.append(dict_of(record));
            return all;
          },
          py::arg("topic"), py::arg("host") = "",
          "All samples of a status topic: a dict each, with the names of the contract.");
  client.def_static("operations", [] {
    std::vector<std::string> names;
    for (const auto& operation : Client::operations()) names.push_back(operation.name);
    return names;
  });
  client.def(
      "command",
      [](Client& self, const std::string& operation, const std::string& host, const std::string& instance,
         const std::string& argument, bool boot, bool online) {
        return self.command(operation, host, instance, argument, LoadOptions{boot, online});
      },
      py::arg("operation"), py::arg("host"), py::arg("instance") = "", py::arg("argument") = "",
      py::arg("boot") = false, py::arg("online") = false, NoGil());
  client.def(
      "command_and_tell",
      [](Client& self, const std::string& operation, const std::string& host, const std::string& instance,
         const std::string& argument, py::function done, bool boot, bool online) {
        self.command(operation, host, instance, argument, guarded<Client::Outcome>(std::move(done)),
                     LoadOptions{boot, online});
      },
      py::arg("operation"), py::arg("host"), py::arg("instance"), py::arg("argument"), py::arg("done"),
      py::arg("boot") = false, py::arg("online") = false, "Returns at once; done(outcome) is called once.");
  for (const Client::Operation& operation : Client::operations()) {
    std::string name = operation.name;
    std::ranges::replace(name, ' ', '_');
    if (!py::hasattr(client, name.c_str())) define_command(client, name, operation);
  }
}

void define_watches(ClientClass& client) {
  client
      .def("watch_hosts",
           [](Client& self, py::function callback) {
             return self.watch_hosts(guarded<Client::Host>(std::move(callback)));
           })
      .def("watch_instances",
           [](Client& self, const std::string& host, py::function callback) {
             return begin(self, &Client::watch_instances, host, std::move(callback));
           })
      .def("watch_tasks",
           [](Client& self, const std::string& host, py::function callback) {
             return begin(self, &Client::watch_tasks, host, std::move(callback));
           })
      .def("watch_events",
           [](Client& self, const std::string& host, py::function callback) {
             return begin(self, &Client::watch_events, host, std::move(callback));
           })
      .def("watch_applications",
           [](Client& self, const std::string& host, py::function callback) {
             return begin(self, &Client::watch_applications, host, std::move(callback));
           })
      .def("watch_exceptions",
           [](Client& self, const std::string& host, py::function callback) {
             return begin(self, &Client::watch_exceptions, host, std::move(callback));
           })
      .def("watch_transitions",
           [](Client& self, const std::string& host, py::function callback) {
             return begin(self, &Client::watch_transitions, host, std::move(callback));
           })
      .def(
          "watch_status",
          [](Client& self, const std::string& topic, const std::string& host, py::function callback) {
            return self.watch_status(topic, host, guarded<Client::Record>(std::move(callback)));
          },
          py::arg("topic"), py::arg("host"), py::arg("callback"),
          "As the others, for any status topic: a dict each, with `removed` beside the names of the "
          "contract.");
}

}  // namespace

PYBIND11_MODULE(plchost_client, module) {
  module.doc() =
      "Sees and commands PLC hosts from anywhere over DDS. Import it before any other module that loads "
      "libddsc, as cyclonedds does: else waits follow the clock of the wall.";
  define_error(module);
  define_states(module);
  define_results(module);
  ClientClass client(
      module, "Client",
      "One connection to all hosts of a DDS domain, or to one: host. timeout: seconds, of each call.");
  client.def(py::init([](unsigned domain, std::vector<std::string> interfaces, std::vector<std::string> peers,
                         std::string identity, double timeout, std::string host) {
               Holder<Client> made(new Client(options_of(domain, std::move(interfaces), std::move(peers),
                                                         std::move(identity), timeout, std::move(host))));
               clients().add(made.get());
               return made;
             }),
             py::arg("domain") = 0U, py::arg("interfaces") = std::vector<std::string>{"lo"},
             py::arg("peers") = std::vector<std::string>{}, py::arg("identity") = "",
             py::arg("timeout") = 3.0, py::arg("host") = "");
  define_calls(client);
  define_commands(client);
  define_watches(client);
  py::module_::import("atexit").attr("register")(py::cpp_function([] { clients().close(); }, NoGil()));
}
