"""Files of one matrix as lines of row, column, value: CalculiX and Matrix Market."""
