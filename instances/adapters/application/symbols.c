/*
 * The variables that can be seen, written and forced from outside, and the programs that they are of.
 */
#include <string.h>

#include "plc_app.h"
#include "plc_variables.h"
#include "plchost_adapter.h"

static RTS_RESULT declaring;

static void declare(const struct plchost_symbol* symbol) {
  Plc_Variable variable;
  unsigned int i;
  const int is_string = symbol->type == PLC_TYPE_STRING || symbol->type == PLC_TYPE_COUNTED_STRING ||
                        symbol->type == PLC_TYPE_SIZED_STRING || symbol->type == PLC_TYPE_SIZED_WSTRING;
  RTS_RESULT result;
  memset(&variable, 0, sizeof variable);
  variable.dwSize = sizeof variable;
  variable.pszName = symbol->name;
  variable.dwType = symbol->type;
  variable.dwFlags = symbol->read_only ? PLC_VARIABLE_READ_ONLY : 0;
  variable.pAddress = symbol->value;
  variable.dwBytes = is_string ? symbol->bytes : 0;
  variable.nDimensions = symbol->dimensions;
  for (i = 0; i < symbol->dimensions && i < PLC_MAX_DIMENSIONS; ++i) {
    variable.aDimensions[i].nFirst = symbol->dimension[i].first;
    variable.aDimensions[i].nCount = symbol->dimension[i].count;
    variable.aDimensions[i].dwStride = symbol->dimension[i].stride;
  }
  variable.pszTask = symbol->task;
  variable.pszArea = symbol->area;
  if (symbol->area == NULL && plchost_is_retained(symbol->value)) variable.pszArea = "retain";
  result = plc_declare_variable(&variable);
  if (result != ERR_OK && declaring == ERR_OK) declaring = result;
}

/* As plc_variables.h says. A global of the same name is the one that is seen. */
static void declare_program(const struct plchost_program* program) {
  Plc_Variable variable;
  RTS_RESULT result;
  memset(&variable, 0, sizeof variable);
  variable.dwSize = sizeof variable;
  variable.pszName = program->name;
  variable.dwType = PLC_TYPE_STRING;
  variable.dwFlags = PLC_VARIABLE_READ_ONLY;
  memcpy(&variable.pAddress, &program->type, sizeof variable.pAddress); /* of a const: it is read-only */
  variable.dwBytes = (unsigned int)strlen(program->type) + 1;
  variable.pszTask = program->task;
  variable.pszArea = "program";
  result = plc_declare_variable(&variable);
  if (result != ERR_OK && result != ERR_DUPLICATE && declaring == ERR_OK) declaring = result;
}

/* A program with more variables than there is room for runs all the same: the log says so. */
int plchost_declare_symbols(void) {
  unsigned int i;
  plchost_each_symbol(declare);
  for (i = 0; i < plchost_program_count; ++i) declare_program(&plchost_programs[i]);
  if (declaring == ERR_NOMEMORY)
    plc_log(PLC_LOG_WARNING, "not all variables can be seen from outside: there are too many");
  return declaring == ERR_OK || declaring == ERR_NOMEMORY;
}
