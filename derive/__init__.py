"""The mathematics, and nothing else: sympy in, files out.

Read in this order, which is also the order of the imports:

    ir                domains, quantities, records, structs, named steps, functions
    model/            quantities, the equations of motion (1)-(4), declare (the elements of a file), mechanism (what they
                      become, what is refused); structs of the C interface, words, precisions, selftest's cases
    model_file        a model from a file of elements
    models/, shipped  the mechanisms that ship, a file each
    maths/            laplace (6)-(15), partial_fractions (11), (16)-(18), time_domain (18)-(21), modes,
                      energy (22)-(24), work (24) in closed form, control (5), (25)-(27), sensitivity, flight,
                      contact, stability, kernels;
                      formulas, the derivation in the paper's order
    paper/            the register: as printed, as derived, verdict, reason
    emit/             program, expressions, numpy, c, instantiate; toml, texts, facts; sources, examples, the parts of a
                      solver (library, package, firmware, pages), render, folder; forms, in which formulas are
                      pasted
    derivation        the door: the formulas of a model as objects of sympy
    page, solver      EQUATIONS.md of a model; all files of its solver's folder
    prove/            identities by algebra, and each formula at 40 digits against the elements of the file
"""

VERSION = "0.2.0"
