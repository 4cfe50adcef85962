(* Read cases as words on standard input, and print the proved checkers' verdicts, one a line.

   A list is its length and then its items. Formulas come operator first. *)

open Checkers

let next () = Scanf.scanf " %s" (fun s -> s)
let int () = int_of_string (next ())

let list item =
  let n = int () in
  List.init n (fun _ -> ()) |> List.map (fun () -> item ())

let rec nat_of i = if i = 0 then O else S (nat_of (i - 1))
let rec int_of = function O -> 0 | S n -> 1 + int_of n
let nat () = nat_of (int ())

let rec pos_of i = if i = 1 then XH else if i land 1 = 1 then XI (pos_of (i / 2)) else XO (pos_of (i / 2))
let z_of i = if i = 0 then Z0 else Zpos (pos_of i)

(* A hexadecimal number of any length. *)
let z () =
  let s = next () in
  let negative = s.[0] = '-' in
  let bit found one =
    match found with Z0 -> if one then Zpos XH else Z0 | Zpos p -> Zpos (if one then XI p else XO p) | Zneg _ -> found
  in
  let digit found c =
    let value = int_of_string (Printf.sprintf "0x%c" c) in
    List.fold_left (fun z k -> bit z (value land k <> 0)) found [8; 4; 2; 1]
  in
  let value = Seq.fold_left digit Z0 (String.to_seq (if negative then String.sub s 1 (String.length s - 1) else s)) in
  if negative then Z.opp value else value

let rec bits = function XH -> "1" | XO p -> bits p ^ "0" | XI p -> bits p ^ "1"
let show = function Z0 -> "0" | Zpos p -> bits p | Zneg p -> "-" ^ bits p

(* Trees *)

let condition () = let kept = list z in let broken = list z in { kept; broken }
let region () =
  let parts = list (fun () -> list nat) in
  let choices = list (fun () -> list nat) in
  { parts; choices }

(* A word that is no mark is nothing. *)
let mark () =
  match next () with
  | "s" -> Some Split | "m" -> Some (Leaf Must) | "n" -> Some (Leaf No)
  | "y" -> Some (Leaf Near) | "i" -> Some (Leaf Coming) | "o" | "f" -> Some (Leaf Out) | "?" -> Some (Leaf Open) | _ -> None

let name = function Must -> "m" | No -> "n" | Near -> "y" | Coming -> "i" | Out -> "f" | Open -> "?"

let leaves checker =
  let marks = list mark in
  match if List.mem None marks then None else checker (List.map Option.get marks) with
  | None -> "refused"
  | Some found ->
      String.concat " "
        (List.map (fun ((m, k), d) -> name m ^ ":" ^ show k ^ ":" ^ string_of_int (int_of d)) found)

let tree () =
  let shape = region () in
  let conditions = list condition in
  leaves (check_region shape conditions)

(* A tree of which it is written what its leaves may say: marks, each with a place and a depth. *)
let walk () =
  let known = Hashtbl.create 64 in
  ignore (list (fun () -> let m = next () in let k = next () in Hashtbl.replace known (m, k, int ()) ()));
  let half more (k, d) = (Z.add (Z.mul (z_of 2) k) (z_of more), d + 1) in
  let holds m (k, d) = m = Open || Hashtbl.mem known (name m, show k, d) in
  leaves (check_tree (half 0) (half 1) holds (Z0, 0))

let step () = match next () with "s" -> Split | _ -> Leaf ()

(* Formulas and words *)

let rec spec () =
  match next () with
  | "a" -> SAtom (nat ()) | "t" -> STrue | "!" -> SNot (spec ())
  | "&" -> let f = spec () in SAnd (f, spec ())
  | "|" -> let f = spec () in SOr (f, spec ())
  | "U" -> let f = spec () in SUntil (f, spec ())
  | "R" -> let f = spec () in SRelease (f, spec ())
  | other -> failwith ("operator " ^ other)

let rec formula () =
  match next () with
  | "+" -> Lit (true, nat ()) | "-" -> Lit (false, nat ())
  | "t" -> Const true | "f" -> Const false
  | "&" -> let f = formula () in And (f, formula ())
  | "|" -> let f = formula () in Or (f, formula ())
  | "U" -> let f = formula () in Until (f, formula ())
  | "R" -> let f = formula () in Release (f, formula ())
  | other -> failwith ("operator " ^ other)

let letter () = list nat
let yes b = if b then "yes" else "no"
let word () = let f = spec () in yes (satisfies f (list letter))

(* Invariants *)

let robot () =
  let shown = list letter in
  let change () = let q = nat () in (q, nat ()) in
  let changes = list change in
  { shown; changes }

let places () = list nat
let allowed () = let p = list places in (p, list letter)
let marked () = list (fun () -> let q = nat () in (q, int () = 1))
let invariant first = list (fun () -> list (fun () -> let s = first () in (s, list formula)))

let own () =
  let robots = list robot in
  let f = spec () in
  let starts = list places in
  let last = list places in
  let spans = list allowed in
  yes (check_own robots (permitted last) f starts spans (invariant marked))

(* The team shows what its robots show, and one of the letters that the others may add. *)
let joint () =
  let robots = list robot in
  let f = spec () in
  let own c = List.concat (List.map2 letter_at robots c) in
  let letters others c = List.map (fun a -> own c @ a) others in
  let first = list letter in
  let starts = List.concat_map (fun c -> List.map (fun a -> (a, c)) (letters first c)) (list places) in
  let last = list places in
  let spans = List.map (fun (allowed, others) -> (allowed, letters others)) (list allowed) in
  yes (check_joint robots (permitted last) f starts spans (invariant places))

(* The same, with all that the team may show written out, by where its robots are. *)
let shown_by_places () =
  let allowed = list places in
  let shown = Hashtbl.create 64 in
  ignore (list (fun () -> let c = places () in Hashtbl.replace shown c (list letter)));
  (allowed, Hashtbl.find shown)

let start () = let a = letter () in (a, places ())

let team () =
  let robots = list robot in
  let f = spec () in
  let starts = list start in
  let last = list places in
  let spans = list shown_by_places in
  yes (check_joint robots (permitted last) f starts spans (invariant places))

(* What levels name, and configurations with their levels. *)
let levels () = list (fun () -> match next () with "lap" -> None | _ -> Some (formula ()))
let entries state = list (fun () -> list (fun () -> let s = state () in let c = list formula in ((s, c), nat ())))

(* Of each robot its places in the copy of a lap, and how far the lap is before it. *)
let turn () =
  let robots = list (fun () -> let copy = places () in (copy, int ())) in
  let before (copy, shift) q = if List.mem q copy then Some (nat_of (int_of q - shift)) else None in
  fun c ->
    let found = List.map2 before robots c in
    if List.mem None found then None else Some (List.map Option.get found)

let of_laps check span starts state =
  let robots = list robot in
  let f = spec () in
  let starts = list starts in
  let turn = turn () in
  let spans = list span in
  let back = int () in
  let levels = levels () in
  yes (check robots turn (List.nth spans back) f starts spans (nat_of back) levels (entries state))

(* Any system, written out: for each span its moves and how it is entered, by states. *)
let move () = let o = (match next () with "-" -> None | _ -> Some (letter ())) in (o, marked ())
let table () =
  let found = Hashtbl.create 64 in
  List.iter (fun (s, ms) -> Hashtbl.replace found s ms) (list (fun () -> let s = marked () in (s, list move)));
  Hashtbl.find found

let span () = let moves = table () in (moves, table ())

let system () =
  let f = formula () in
  let starts = list move in
  let spans = list span in
  let finals = list marked in
  let final s = List.mem s finals in
  yes (check_invariant (fun (moves, _) -> moves) (fun (_, enters) -> enters) final read_more f starts spans (invariant marked))

(* The same of laps: the steps from the last span to an earlier one, and what levels name. *)
let laps () =
  let f = formula () in
  let starts = list move in
  let spans = list span in
  let turns = table () in
  let back = nat () in
  let levels = levels () in
  yes (check_laps (fun (moves, _) -> moves) (fun (_, enters) -> enters) turns read_more f starts spans back levels (entries marked))

let () =
  try
    while true do
      match next () with
      | "" -> raise End_of_file
      | "tree" -> print_endline (tree ())
      | "walk" -> print_endline (walk ())
      | "limit" -> let row = list z in print_endline (yes (check_nonneg row (list step)))
      | "word" -> print_endline (word ())
      | "joint" -> print_endline (joint ())
      | "team" -> print_endline (team ())
      | "own" -> print_endline (own ())
      | "system" -> print_endline (system ())
      | "laps" -> print_endline (laps ())
      | "own-laps" -> print_endline (of_laps check_own_laps allowed places marked)
      | "team-laps" -> print_endline (of_laps check_joint_laps shown_by_places start places)
      | other -> failwith ("case " ^ other)
    done
  with End_of_file -> ()
