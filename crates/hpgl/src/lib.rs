//! HPGL and HP-GL/2: lexer, parser, interpreter, diagnostics, emitter
