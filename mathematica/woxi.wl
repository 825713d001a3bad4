(* SPDX-License-Identifier: MIT *)
(* What the notebook needs and Woxi lacks; loaded under Woxi alone. *)

$FrontEnd = Null;  (* no front end, as under wolframscript *)

(* Woxi's NDSolveValue knows no vectors, and takes 1000 equal steps whatever accuracy is asked for. Here it takes the
   steps of Dormand and Prince (1980), of order 5 with an error estimate, and between them their interpolant of order 4:
   hence the tenth of the error that is asked for. What it remembers stays in global symbols: passed as arguments it would be copied at every evaluation. *)

refuse[why_] := (WriteString["stderr", "NDSolveValue, stand-in under Woxi: ", why, "\n"]; Exit[1]);

nodes = {0, 1/5, 3/10, 4/5, 8/9, 1, 1};
stages = N[{{}, {1/5}, {3/40, 9/40}, {44/45, -56/15, 32/9}, {19372/6561, -25360/2187, 64448/6561, -212/729},
  {9017/3168, -355/33, 46732/5247, 49/176, -5103/18656}, {35/384, 0, 500/1113, 125/192, -2187/6784, 11/84}}];
errors = N[{-71/57600, 0, 71/16695, -71/1920, 17253/339200, -22/525, 1/40}];
interpolant = N[{  (* of the seven slopes: coefficients of s, s^2, s^3, s^4 *)
  {1, -8048581381/2820520608, 8663915743/2820520608, -12715105075/11282082432}, {0, 0, 0, 0},
  {0, 131558114200/32700410799, -68118460800/10900136933, 87487479700/32700410799},
  {0, -1754552775/470086768, 14199869525/1410260304, -10690763975/1880347072},
  {0, 127303824393/49829197408, -318862633887/49829197408, 701980252875/199316789632},
  {0, -282668133/205662961, 2019193451/616988883, -1453857185/822651844},
  {0, 40617522/29380423, -110615467/29380423, 69997945/29380423}}];

Unprotect[NDSolveValue];
NDSolveValue[equations_List, function_Symbol, {t_, start_, end_}, options___] := Module[
  {law, values, time, step, limit, absolute, relative, slopes, size, next, difference, remaining},
  If[Length[equations] != 2 || equations[[1, 1]] =!= Derivative[1][function][t] ||
    equations[[2, 1]] =!= function[start], refuse["the equations are not those of a vector and of its start"]];
  If[! MemberQ[{options}, Method -> {"ExplicitRungeKutta", "DifferenceOrder" -> 5}],
    refuse["the Method is not the explicit Runge-Kutta method of order 5"]];
  If[! And @@ Map[NumberQ[# /. {options}] &, {PrecisionGoal, AccuracyGoal, MaxStepSize}],
    refuse["a goal or MaxStepSize is not a number"]];
  If[! MemberQ[{options}, InterpolationOrder -> All], refuse["InterpolationOrder is not All"]];
  law = equations[[1, 2]];
  slope[at_, x_] := law /. {function[t] -> x, t -> at};
  values = N[equations[[2, 2]]];
  time = N[start];
  {relative, absolute} = 10.^-({PrecisionGoal, AccuracyGoal} /. {options});
  limit = MaxStepSize /. {options};
  step = limit / 10;
  ends = {time};
  pieces = {};
  slopes = {slope[time, values]};
  While[time < end && step > 10.^-12,
    remaining = end - time;
    If[step > remaining * (1 - 10.^-9), step = remaining];
    slopes = Take[slopes, 1];
    Do[
      next = values + step * (stages[[i]] . slopes);
      AppendTo[slopes, slope[time + nodes[[i]] * step, next]],
      {i, 2, 7}];
    difference = step * (errors . slopes);
    size = If[VectorQ[next, NumberQ] && Max[Abs[next]] < 10.^100,
      10 * Max[Abs[difference] / (absolute + relative * Map[Max, Transpose[{Abs[values], Abs[next]}]])], 10.^10];
    If[TrueQ[size <= 1],
      AppendTo[pieces, {values, step * (Transpose[interpolant] . slopes)}];
      time = If[step == remaining, N[end], time + step];
      AppendTo[ends, time];
      values = next;
      slopes = {slopes[[7]]}];
    step = Min[limit, step * Clip[0.9 * Max[size, 10.^-10]^(-1/5), {0.2, 5.}]]];
  interpolated];

interpolated["Domain"] := {{First[ends], Last[ends]}};
interpolated[t_?NumberQ] := Module[{low = 1, high = Length[ends] - 1, middle, s},
  While[low < high,
    middle = Quotient[low + high + 1, 2];
    If[ends[[middle]] <= t, low = middle, high = middle - 1]];
  s = (t - ends[[low]]) / (ends[[low + 1]] - ends[[low]]);
  pieces[[low, 1]] + {s, s^2, s^3, s^4} . pieces[[low, 2]]];

(* Woxi's RenameFile overwrites silently; the kernel's refuses. *)

Unprotect[RenameFile];
RenameFile[source_, target_] /; FileExistsQ[target] := $Failed;
