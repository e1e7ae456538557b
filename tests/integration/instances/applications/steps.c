/* A program that can be debugged, written by hand: lines of "steps.st", of which there is no file. The tasks
 * Main and Edge write an output area each. */
#include <string.h>

#include "instances/plc_app.h"
#include "instances/plc_debug.h"
#include "instances/plc_variables.h"

PLC_EXPORT_ABI;

struct counter {
  short step;
  int n;
};
static struct {
  int cycles;
  int doubled;
  unsigned char go;
  struct counter counter;
} main_program;
static struct {
  int cycles;
} other_program;
static struct {
  int runs;
} edge_program;

/* Two of a program that never runs. Its variable lies apart, as one at a location does. */
static struct {
  int unused;
} lamps[2];
static int lit[2];
static int bias;

/* The text of all local variables of Deep: too long to be told of all its calls. */
static char label[256];

/* Of the elements of Wide's arrays. 16 elements of each array are too long to be told: the short texts of two
 * calls, the long ones also of one. */
#define WIDE_ELEMENTS 16
static char labels[2][WIDE_ELEMENTS][sizeof label];

static void* main_output;
static void* edge_output;

static const unsigned int twice_lines[] = {2};
static const unsigned int counter_lines[] = {12, 14};
static const unsigned int main_lines[] = {22, 23, 24, 26};
static const unsigned int other_lines[] = {32, 33};
static const unsigned int edge_lines[] = {42};
static const unsigned int lamp_lines[] = {52};
static const unsigned int deep_lines[] = {62};
static const Plc_Local twice_locals[] = {{"value", PLC_TYPE_DINT, 0, 0, 0},
                                         {"factor", PLC_TYPE_INT, 0, 0, 0},
                                         {"word", PLC_TYPE_STRING, 8, 0, 0},
                                         {"cells[]", PLC_TYPE_INT, 0, 0, 0}};
static const Plc_LocalArray twice_arrays[] = {{3, 1, {{1, 300, sizeof(short)}}}};
static Plc_Pou twice = {sizeof(Plc_Pou), "Twice", "src/steps.st", twice_lines, 1, 0, twice_locals, 4,
                        twice_arrays,    1};
static Plc_Pou counter = {sizeof(Plc_Pou), "Counter", "src/steps.st", counter_lines, 2, 0, 0, 0, 0, 0};
static Plc_Pou main_pou = {sizeof(Plc_Pou), "Main", "src/steps.st", main_lines, 4, 0, 0, 0, 0, 0};
static Plc_Pou other = {sizeof(Plc_Pou), "Other", "src/steps.st", other_lines, 2, 0, 0, 0, 0, 0};
static Plc_Pou edge = {sizeof(Plc_Pou), "Edge", "src/steps.st", edge_lines, 1, 0, 0, 0, 0, 0};
static Plc_Pou lamp = {sizeof(Plc_Pou), "Lamp", "src/steps.st", lamp_lines, 1, 0, 0, 0, 0, 0};
#define DEEP_TEXT(name) {name, PLC_TYPE_STRING, sizeof label, 0, 0}
static const Plc_Local deep_locals[] = {{"level", PLC_TYPE_INT, 0, 0, 0},
                                        DEEP_TEXT("a"),
                                        DEEP_TEXT("b"),
                                        DEEP_TEXT("c"),
                                        DEEP_TEXT("d"),
                                        DEEP_TEXT("e"),
                                        DEEP_TEXT("f"),
                                        DEEP_TEXT("g"),
                                        DEEP_TEXT("h")};
static Plc_Pou deep = {sizeof(Plc_Pou), "Deep", "src/steps.st", deep_lines, 1, 0, deep_locals, 9, 0, 0};

static const unsigned int wide_lines[] = {72};
#define WIDE_ARRAYS 16
#define WIDE_TEXTS(name) {name "[]", PLC_TYPE_STRING, sizeof label, 0, 0}
static const Plc_Local wide_locals[] = {{"from_deep", PLC_TYPE_BOOL, 0, 0, 0},
                                        {"again", PLC_TYPE_BOOL, 0, 0, 0},
                                        WIDE_TEXTS("a"),
                                        WIDE_TEXTS("b"),
                                        WIDE_TEXTS("c"),
                                        WIDE_TEXTS("d"),
                                        WIDE_TEXTS("e"),
                                        WIDE_TEXTS("f"),
                                        WIDE_TEXTS("g"),
                                        WIDE_TEXTS("h"),
                                        WIDE_TEXTS("i"),
                                        WIDE_TEXTS("j"),
                                        WIDE_TEXTS("k"),
                                        WIDE_TEXTS("l"),
                                        WIDE_TEXTS("m"),
                                        WIDE_TEXTS("n"),
                                        WIDE_TEXTS("o"),
                                        WIDE_TEXTS("p")};
static Plc_LocalArray wide_arrays[WIDE_ARRAYS];
static Plc_Pou wide = {sizeof(Plc_Pou), "Wide",          "src/steps.st", wide_lines, 1, 0,
                       wide_locals,     2 + WIDE_ARRAYS, wide_arrays,    WIDE_ARRAYS};

static void run_wide(unsigned char from_deep, unsigned char again) {
  void* const texts = labels[from_deep];
  void* const locals[] = {&from_deep, &again, texts, texts, texts, texts, texts, texts, texts,
                          texts,      texts,  texts, texts, texts, texts, texts, texts, texts};
  PLC_ENTER_LOCALS(wide, 0, locals, 0);
  PLC_STATEMENT(72);
  if (again) run_wide(from_deep, 0);
}

static void run_deep(short level) {
  void* const locals[] = {&level, label, label, label, label, label, label, label, label};
  PLC_ENTER_LOCALS(deep, 0, locals, 0);
  PLC_STATEMENT(62);
  if (level > 0) {
    run_deep((short)(level - 1));
  } else {
    run_wide(1, 0);
  }
}

static int run_twice(int value) {
  short factor = 2;
  char word[8] = "double";
  short cells[300] = {(short)value, 7};
  void* const locals[] = {&value, &factor, word, cells};
  PLC_ENTER_LOCALS(twice, 0, locals, 0);
  PLC_STATEMENT(2);
  return factor * value + cells[2];
}

static void run_counter(struct counter* self) {
  PLC_ENTER(counter, self);
  PLC_STATEMENT(12);
  if (self->step > 0) {
    PLC_STATEMENT(14);
    self->n += self->step;
  }
}

static void CDECL run_main(void) {
  PLC_ENTER(main_pou, &main_program);
  PLC_STATEMENT(22);
  ++main_program.cycles;
  PLC_STATEMENT(23);
  run_counter(&main_program.counter);
  PLC_STATEMENT(24);
  main_program.doubled = run_twice(main_program.counter.n);
  PLC_STATEMENT(26);
  main_program.go = 1;
  *(int*)main_output = main_program.cycles;
}

static void CDECL run_other(void) {
  PLC_ENTER(other, &other_program);
  PLC_STATEMENT(32);
  ++other_program.cycles;
  PLC_STATEMENT(33);
  (void)other_program.cycles;
}

static void CDECL run_edge(void) {
  PLC_ENTER(edge, &edge_program);
  PLC_STATEMENT(42);
  ++edge_program.runs;
  *(int*)edge_output = edge_program.runs;
  run_deep(40);
  run_wide(0, 1);
}

static int declare_wide(void) {
  for (unsigned int i = 0; i < WIDE_ARRAYS; ++i) {
    const Plc_LocalArray array = {i + 2, 1, {{0, WIDE_ELEMENTS, sizeof label}}};
    wide_arrays[i] = array;
  }
  for (unsigned int i = 0; i < WIDE_ELEMENTS; ++i) {
    memset(labels[0][i], 'x', 150);
    memset(labels[1][i], 'x', sizeof label - 1);
  }
  return plc_debug_declare_pou(&wide) == ERR_OK;
}

static int declare_pous(void) {
  return plc_debug_declare_pou(&twice) == ERR_OK && plc_debug_declare_pou(&counter) == ERR_OK &&
         plc_debug_declare_pou(&main_pou) == ERR_OK && plc_debug_declare_pou(&other) == ERR_OK &&
         plc_debug_declare_pou(&edge) == ERR_OK && plc_debug_declare_pou(&lamp) == ERR_OK &&
         plc_debug_declare_pou(&deep) == ERR_OK && declare_wide() &&
         plc_debug_declare_instance(&lamp, &lamps[0], "left") == ERR_OK &&
         plc_debug_declare_instance(&lamp, &lamps[1], "right") == ERR_OK &&
         plc_debug_declare_instance(&main_pou, &main_program, "Main") == ERR_OK &&
         plc_debug_declare_instance(&counter, &main_program.counter, "Main.counter") == ERR_OK &&
         plc_debug_declare_instance(&other, &other_program, "Other") == ERR_OK;
}

static int declare_output(const char* name, unsigned int flags, const char* task, void** address) {
  Plc_Area_Use use = {task, 0, 0, address};
  Plc_Area area = {sizeof area, PLC_AREA_OUTPUT | flags, name, sizeof(int), 1, &use, 0, 0, 0};
  return plc_declare_area(&area, NULL) != RTS_INVALID_HANDLE;
}

static void set_task(Task_Info* task, const char* name, short kind, short priority, void(CDECL* run)(void)) {
  strcpy(task->stName, name);
  task->KindOfTask = kind;
  task->nPriority = priority;
  task->dwTaskEntryFunctionPointer = run;
}

int CDECL plc_app_init(void) {
  static Task_Info tasks[3];
  static sys_setup_tasks_struct setup;
  main_program.counter.step = 1;
  memset(label, 'x', sizeof label - 1);
  set_task(&tasks[0], "Main", Cyclic, 2, run_main);
  tasks[0].dwInterval = 10;
  set_task(&tasks[1], "Other", Cyclic, 1, run_other);
  tasks[1].dwInterval = 5;
  set_task(&tasks[2], "Edge", External, 0, run_edge);
  strcpy(tasks[2].stExternalEvent, "edge");
  strcpy(setup.stApplicationName, "Steps");
  setup.nTasks = 3;
  setup.ptaskinfo = tasks;
  if (!declare_pous()) return 1;
  if (!declare_output("main", 0, "Main", &main_output) ||
      !declare_output("edge", 0x8000, "Edge", &edge_output))
    return 3;
  PLC_DECLARE_VARIABLE("Main.cycles", PLC_TYPE_DINT, main_program.cycles);
  PLC_DECLARE_VARIABLE("Main.doubled", PLC_TYPE_DINT, main_program.doubled);
  PLC_DECLARE_VARIABLE("Main.go", PLC_TYPE_BOOL, main_program.go);
  PLC_DECLARE_VARIABLE("Main.counter.step", PLC_TYPE_INT, main_program.counter.step);
  PLC_DECLARE_VARIABLE("Main.counter.n", PLC_TYPE_DINT, main_program.counter.n);
  PLC_DECLARE_VARIABLE("Other.cycles", PLC_TYPE_DINT, other_program.cycles);
  PLC_DECLARE_VARIABLE("left.lit", PLC_TYPE_DINT, lit[1]);
  PLC_DECLARE_VARIABLE("right.lit", PLC_TYPE_DINT, lit[0]);
  PLC_DECLARE_VARIABLE("bias", PLC_TYPE_DINT, bias);
  PLC_DECLARE_VARIABLE("Edge.runs", PLC_TYPE_DINT, edge_program.runs);
  __sys__setup__tasks(&setup);
  return SchedRegisterExternalEvent("edge", NULL) != RTS_INVALID_HANDLE ? 0 : 2;
}
