(* SPDX-License-Identifier: MIT *)
(* What the notebook needs and Woxi lacks; loaded under Woxi alone. *)

$FrontEnd = Null;  (* no front end, as under wolframscript *)

(* Woxi's NDSolveValue takes 1000 equal RK4 steps over whatever span it is given and ignores the accuracy asked for.
   Here the span is cut into pieces of 1 s, each started from the end of the one before: steps of 0.001 s. The
   pieces stay in global symbols (count, ends, piece): passed as arguments they would be copied at every evaluation. *)

pieceLength = 1.0;

refuse[why_] := (WriteString["stderr", "NDSolveValue, stand-in under Woxi: ", why, "\n"]; Exit[1]);

Unprotect[NDSolveValue];
inPieces = False;
NDSolveValue[equations_List, functions_List, {t_, start_, end_}, options___] /; ! inPieces :=
  Block[{inPieces = True}, Module[{initial, law, values, solutions},
    initial = Select[equations, MemberQ[functions, Head[#[[1]]]] &];  (* x[start] == value *)
    If[! And @@ Map[TrueQ[#[[1, 1]] == start] &, initial], refuse["an initial condition is not at the start"]];
    If[! MemberQ[{options}, Method -> {"ExplicitRungeKutta", "DifferenceOrder" -> 5}],
      refuse["the Method is not the explicit Runge-Kutta method of order 5"]];
    If[! And @@ Map[NumberQ[# /. {options}] &, {PrecisionGoal, AccuracyGoal, MaxStepSize}],
      refuse["a goal or MaxStepSize is not a number"]];
    If[! MemberQ[{options}, InterpolationOrder -> All], refuse["InterpolationOrder is not All"]];
    law = Complement[equations, initial];
    values = functions /. Map[Function[e, Head[e[[1]]] -> e[[2]]], initial];
    count = Ceiling[(end - start) / pieceLength];
    ends = start + (end - start) * Range[0, count] / count;
    Do[
      solutions = NDSolveValue[Join[law, Thread[Map[#[ends[[i]]] &, functions] == values]],
        functions, {t, ends[[i]], ends[[i + 1]]}];
      values = Map[#[ends[[i + 1]]] &, solutions];
      If[! And @@ Map[TrueQ[Abs[#] < 10.^100] &, values], count = i - 1; ends = Take[ends, i]; Break[]];
      Do[piece[k, i] = solutions[[k]], {k, Length[functions]}],
      {i, count}];
    Map[spliced, Range[Length[functions]]]]];

(* spliced[k] is the k-th solution, over all pieces *)
spliced[k_]["Domain"] := {{First[ends], Last[ends]}};
spliced[k_][t_?NumberQ] :=
  piece[k, Clip[Ceiling[count * (t - First[ends]) / (Last[ends] - First[ends])], {1, count}]][t];

(* Woxi's RenameFile overwrites silently; the kernel's refuses. *)

Unprotect[RenameFile];
RenameFile[source_, target_] /; FileExistsQ[target] := $Failed;
