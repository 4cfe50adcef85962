(** Flights that go round for ever: an inductive invariant with levels implies the formula.

    As in `Invariant.v` a system makes moves in a span and goes on to the next; from the
    last span it goes back to an earlier one, a lap before.  Configurations have a level,
    which never rises.  Each level names an until that every reading within the level puts
    off, or the lap, which is not gone round within the level.  A flight that goes round
    for ever stays within one level in the end: so the until was never satisfied. *)

Require Import List Bool Arith Lia.
From LtlPlan Require Import Progression Invariant Endless.
Import ListNotations.

Section Laps.
  Variables (S Span : Type).
  Variable moves : Span -> S -> list (option letter * S).
  Variable enters : Span -> S -> list (option letter * S).
  (** From the last span to the one to which it leads back. *)
  Variable turns : S -> list (option letter * S).
  Variable below : S -> S -> bool.

  (** *** The algorithm *)

  (** A level's until; the lap where there is none. *)
  Definition level : Type := option formula.
  Definition entry : Type := S * alternative * nat.

  Definition stays (levels : list level) (l : nat) (o : option letter) (off : alternative) (lap : bool) : bool :=
    match nth_error levels l with
    | Some None => negb lap
    | Some (Some u) => match o with Some _ => existsb (same u) off | None => true end
    | None => false
    end.

  Definition choices (o : option letter) (c : alternative) : list choice :=
    match o with Some a => unwind_all a c | None => [(c, [])] end.

  Definition step_covered (levels : list level) (l : nat) (lap : bool) (i : list entry)
      (o : option letter) (s : S) (c : choice) : bool :=
    existsb (fun e => below (fst (fst e)) s && includes (fst c) (snd (fst e))
      && ((snd e <? l) || ((snd e =? l) && stays levels l o (snd c) lap))) i.

  Definition steps_covered (levels : list level) (l : nat) (lap : bool) (i : list entry)
      (c : alternative) (ms : list (option letter * S)) : bool :=
    forallb (fun m => forallb (step_covered levels l lap i (fst m) (snd m)) (choices (fst m) c)) ms.

  (** From each configuration of [i] the steps lead to configurations of [j]. *)
  Definition leads (levels : list level) (lap : bool) (next : S -> list (option letter * S))
      (i j : list entry) : bool :=
    forallb (fun e => steps_covered levels (snd e) lap j (snd (fst e)) (next (fst (fst e)))) i.

  Fixpoint rounds (levels : list level) (seam : list entry) (ps : list Span) (is : list (list entry)) : bool :=
    match ps, is with
    | [p], [i] => leads levels false (moves p) i i && leads levels true turns i seam
    | p :: (q :: _) as qs, i :: (j :: _) as js =>
        leads levels false (moves p) i i && leads levels false (enters q) i j && rounds levels seam qs js
    | _, _ => false
    end.

  (** [back]: the span to which the last one leads. *)
  Definition check_laps (f : formula) (starts : list (option letter * S)) (ps : list Span) (back : nat)
      (levels : list level) (is : list (list entry)) : bool :=
    match is with
    | i :: _ => steps_covered levels (length levels) false i [f] starts
        && rounds levels (nth back is []) ps is
    | [] => false
    end.

  (** *** Flights without end *)

  Variables (ps : list Span) (back : nat).

  (** A step from one span and state to another one; whether it goes round. *)
  Definition goes (p : nat) (s : S) (o : option letter) (lap : bool) (p' : nat) (s' : S) : Prop :=
    (lap = false /\ p' = p /\ exists q, nth_error ps p = Some q /\ In (o, s') (moves q s)) \/
    (lap = false /\ p' = 1 + p /\ exists q, nth_error ps (1 + p) = Some q /\ In (o, s') (enters q s)) \/
    (lap = true /\ 1 + p = length ps /\ p' = back /\ In (o, s') (turns s)).

  Definition reads (w : endless) (n : nat) (o : option letter) (n' : nat) : Prop :=
    match o with Some a => w n = a /\ n' = 1 + n | None => n' = n end.

  (** The word is read letter by letter; laps have no end, nor have letters. *)
  Definition flies (w : endless) (o0 : option letter) (s0 : S) : Prop :=
    exists (span : nat -> nat) (state : nat -> S) (out : nat -> option letter) (lap : nat -> bool) (place : nat -> nat),
      span 0 = 0 /\ state 0 = s0 /\ reads w 0 o0 (place 0) /\
      (forall k, goes (span k) (state k) (out k) (lap k) (span (1 + k)) (state (1 + k))) /\
      (forall k, reads w (place k) (out k) (place (1 + k))) /\
      (forall k, exists j, k <= j /\ lap j = true) /\
      (forall k, exists j, k <= j /\ out j <> None).

  (** *** Soundness *)

  Hypothesis below_trans : forall a b c, below a b = true -> below b c = true -> below a c = true.
  Hypothesis below_moves : forall t s p o s', below t s = true -> In (o, s') (moves p s) ->
    exists t', In (o, t') (moves p t) /\ below t' s' = true.
  Hypothesis below_enters : forall t s p o s', below t s = true -> In (o, s') (enters p s) ->
    exists t', In (o, t') (enters p t) /\ below t' s' = true.
  Hypothesis below_turns : forall t s o s', below t s = true -> In (o, s') (turns s) ->
    exists t', In (o, t') (turns t) /\ below t' s' = true.
  Hypothesis below_refl : forall s, below s s = true.

  Variables (w : endless) (levels : list level).

  Definition owed (c : alternative) (n : nat) : Prop := forall f, In f c -> holds f w n.

  (** What a step within level [l] keeps to. *)
  Definition keeps_to (l n : nat) (o : option letter) (lap : bool) : Prop :=
    match nth_error levels l with
    | Some None => lap = false
    | Some (Some u) => o = None \/ put_off w n u
    | None => False
    end.

  Lemma choice_made : forall o c n n', reads w n o n' -> owed c n ->
    exists ch, In ch (choices o c) /\ owed (fst ch) n' /\ (o = None \/ forall f, In f (snd ch) -> put_off w n f).
  Proof.
    intros [a|] c n n' R K; cbn in *.
    - destruct R as [<- ->]; destruct (unwind_all_open c w n K) as (ch & H & G1 & G2).
      exists ch; repeat split; auto.
    - subst n'; exists (c, []); split; [left; auto | auto].
  Qed.

  Lemma step_taken : forall l lap i c ms o t s n n',
    steps_covered levels l lap i c ms = true -> In (o, t) ms -> below t s = true ->
    reads w n o n' -> owed c n ->
    exists t' c' l', In (t', c', l') i /\ below t' s = true /\ owed c' n' /\
      (l' < l \/ (l' = l /\ keeps_to l n o lap)).
  Proof.
    intros l lap i c ms o t s n n' A I B R K; unfold steps_covered in A; rewrite forallb_forall in A.
    specialize (A _ I); cbn in A; rewrite forallb_forall in A.
    destruct (choice_made o c n n' R K) as (ch & Hch & O & G); specialize (A ch Hch).
    unfold step_covered in A; apply existsb_exists in A as ([[t' c'] l'] & Ie & C); cbn in C.
    apply andb_prop in C as [C L]; apply andb_prop in C as [C1 C2].
    exists t', c', l'; repeat split; eauto.
    - intros f Hf; apply O, (includes_in (fst ch) c'); auto.
    - apply orb_prop in L as [L|L]; [left; apply Nat.ltb_lt; auto | right].
      apply andb_prop in L as [E L]; apply Nat.eqb_eq in E; split; auto.
      unfold stays in L; unfold keeps_to; destruct (nth_error levels l) as [[u|]|]; try discriminate.
      + destruct o as [a|]; auto; right; destruct G as [G|G]; [discriminate|].
        apply existsb_exists in L as (g & Hg & E'); apply same_eq in E'; subst g; auto.
      + destruct lap; auto; discriminate.
  Qed.

  (** What the checker says of each span. *)
  Lemma rounds_at : forall seam qs is, rounds levels seam qs is = true -> forall p q, nth_error qs p = Some q ->
    leads levels false (moves q) (nth p is []) (nth p is []) = true /\
    (forall q', nth_error qs (1 + p) = Some q' ->
      leads levels false (enters q') (nth p is []) (nth (1 + p) is []) = true) /\
    (1 + p = length qs -> leads levels true turns (nth p is []) seam = true).
  Proof.
    intros seam; induction qs as [|q0 qs IH]; intros is H p q N; [destruct p; discriminate|].
    destruct qs as [|q1 qs], is as [|i [|j is]]; try discriminate.
    - cbn in H; apply andb_prop in H as [H1 H2].
      destruct p as [|[|]]; try discriminate; injection N as <-; repeat split; auto; discriminate.
    - change (leads levels false (moves q0) i i && leads levels false (enters q1) i j
        && rounds levels seam (q1 :: qs) (j :: is) = true) in H.
      apply andb_prop in H as [H H3]; apply andb_prop in H as [H1 H2].
      destruct p as [|p].
      + injection N as <-; cbn; repeat split; auto; [intros q' E; injection E as <-; auto | discriminate].
      + destruct (IH (j :: is) H3 p q N) as (K1 & K2 & K3); cbn in *; repeat split; auto.
  Qed.

  Lemma leads_taken : forall lap next i j t c l o t' s n n', leads levels lap next i j = true ->
    In (t, c, l) i -> In (o, t') (next t) -> below t' s = true -> reads w n o n' -> owed c n ->
    exists u c' l', In (u, c', l') j /\ below u s = true /\ owed c' n' /\
      (l' < l \/ (l' = l /\ keeps_to l n o lap)).
  Proof.
    intros lap next i j t c l o t' s n n' L I N B R K; unfold leads in L; rewrite forallb_forall in L.
    specialize (L _ I); cbn in L; eauto using step_taken.
  Qed.

  Section Flight.
    Variables (span : nat -> nat) (state : nat -> S) (out : nat -> option letter) (lap : nat -> bool).
    Variables (place : nat -> nat) (is : list (list entry)).
    Hypothesis legal : forall k, goes (span k) (state k) (out k) (lap k) (span (1 + k)) (state (1 + k)).
    Hypothesis letters : forall k, reads w (place k) (out k) (place (1 + k)).
    Hypothesis laps : forall k, exists j, k <= j /\ lap j = true.
    Hypothesis read : forall k, exists j, k <= j /\ out j <> None.
    Hypothesis checked : rounds levels (nth back is []) ps is = true.

    (** After [k] steps a configuration of level [l] holds the flight. *)
    Definition held_at (k l : nat) : Prop := exists t c,
      In (t, c, l) (nth (span k) is []) /\ below t (state k) = true /\ owed c (place k).

    Lemma next_held : forall k l, held_at k l ->
      exists l', held_at (1 + k) l' /\ (l' < l \/ (l' = l /\ keeps_to l (place k) (out k) (lap k))).
    Proof.
      intros k l (t & c & I & B & K); pose proof (letters k) as R.
      assert (G : forall lap0 next, leads levels lap0 next (nth (span k) is []) (nth (span (1 + k)) is []) = true ->
        (exists t', In (out k, t') (next t) /\ below t' (state (1 + k)) = true) -> lap0 = lap k ->
        exists l', held_at (1 + k) l' /\ (l' < l \/ (l' = l /\ keeps_to l (place k) (out k) (lap k)))).
      { intros lap0 next L (t' & N & B') ->.
        destruct (leads_taken _ next _ _ t c l (out k) t' _ _ _ L I N B' R K) as (u & c' & l' & I' & Bu & O & E).
        exists l'; split; auto; exists u, c'; auto. }
      assert (P : exists q, nth_error ps (span k) = Some q).
      { destruct (nth_error ps (span k)) as [q|] eqn:E; eauto.
        apply nth_error_None in E.
        destruct (legal k) as [(_ & _ & q & E' & _) | [(_ & _ & q & E' & _) | (_ & E' & _)]].
        - assert (span k < length ps) by (apply nth_error_Some; congruence); lia.
        - assert (1 + span k < length ps) by (apply nth_error_Some; congruence); lia.
        - lia. }
      destruct P as [p P]; destruct (rounds_at _ _ _ checked _ _ P) as (C1 & C2 & C3).
      destruct (legal k) as [(El & Es & q & E & N) | [(El & Es & q & E & N) | (El & E & Es & N)]];
        rewrite Es in G.
      - assert (q = p) by congruence; subst q.
        apply (G false (moves p)); eauto.
      - apply (G false (enters q)); eauto.
      - apply (G true turns); eauto.
    Qed.

    (** No level holds the flight for ever. *)
    Lemma none_held : forall l k, ~ held_at k l.
    Proof.
      induction l as [l Lower] using lt_wf_ind.
      assert (Down : forall k, held_at k l -> held_at (1 + k) l /\ keeps_to l (place k) (out k) (lap k)).
      { intros k H; destruct (next_held k l H) as (l' & H' & [L | [-> K]]); auto.
        exfalso; apply (Lower l' L (1 + k)); auto. }
      assert (On : forall d k, held_at k l -> held_at (d + k) l).
      { induction d as [|d IH]; intros k H; auto; apply (Down (d + k)), IH, H. }
      intros k H; destruct (nth_error levels l) as [[u|]|] eqn:E.
      - assert (Next : forall k, held_at k l -> exists j, k <= j /\ place j = place k /\ held_at j l /\
          put_off w (place k) u /\ place (1 + j) = 1 + place k).
        { intros k0 H0; destruct (read k0) as (j & L & O).
          assert (G : forall d k1, d = j - k1 -> k1 <= j -> held_at k1 l -> exists j, k1 <= j /\
            place j = place k1 /\ held_at j l /\ put_off w (place k1) u /\ place (1 + j) = 1 + place k1).
          { induction d as [|d IH]; intros k1 D Lk H1.
            - assert (k1 = j) by lia; subst j.
              destruct (Down k1 H1) as [_ K]; unfold keeps_to in K; rewrite E in K.
              pose proof (letters k1) as R; destruct (out k1) as [a|] eqn:Ea; [|congruence].
              destruct K as [K|K]; [discriminate|]; destruct R as [_ R]; exists k1; auto.
            - destruct (Down k1 H1) as [H2 K]; unfold keeps_to in K; rewrite E in K.
              pose proof (letters k1) as R; destruct (out k1) as [a|] eqn:Ea.
              + destruct K as [K|K]; [discriminate|]; destruct R as [_ R]; exists k1; auto.
              + unfold reads in R; destruct (IH (1 + k1)) as (j' & Lj & Ej & Hj & Pj & Rj); auto; try lia.
                rewrite R in Ej, Pj, Rj; exists j'; repeat split; auto; lia. }
          apply (G (j - k0)); auto. }
        destruct (Next k H) as (j & _ & _ & _ & P & _); destruct u as [| | | |g h|]; try contradiction.
        destruct P as [(m & Lm & Y & _) _].
        assert (G : forall d k, d = m - place k -> place k <= m -> held_at k l -> False).
        { induction d as [|d IH]; intros k1 D L1 H1;
            destruct (Next k1 H1) as (j1 & _ & Ej & Hj & [_ N] & R1).
          - assert (m = place k1) by lia; subst m; contradiction.
          - destruct (Nat.eq_dec m (place k1)) as [->|NE]; [contradiction|].
            apply (IH (1 + j1)); try lia. apply (Down j1 Hj). }
        apply (G (m - place k) k); auto.
      - destruct (laps k) as (j & L & T).
        assert (Hj : held_at j l) by (replace j with ((j - k) + k) by lia; apply On, H).
        destruct (Down j Hj) as [_ K]; unfold keeps_to in K; rewrite E in K; congruence.
      - destruct (Down k H) as [_ K]; unfold keeps_to in K; rewrite E in K; auto.
    Qed.
  End Flight.

  Theorem check_laps_sound : forall f starts is o s,
    check_laps f starts ps back levels is = true -> In (o, s) starts -> flies w o s -> ~ holds f w 0.
  Proof.
    intros f starts [|i is] o s H I (span & state & out & lap & place & S0 & T0 & R0 & G & R & L & O) K;
      [discriminate|].
    apply andb_prop in H as [A C]; change (rounds levels (nth back (i :: is) []) ps (i :: is) = true) in C.
    assert (Kf : owed [f] 0) by (intros g [<-|[]]; auto).
    rewrite <- T0 in I.
    destruct (step_taken _ _ _ _ _ o _ (state 0) 0 (place 0) A I (below_refl _) R0 Kf)
      as (t & c & l & It & B & Oc & _).
    apply (none_held span state out lap place (i :: is) G R L O C l 0).
    exists t, c; rewrite S0; auto.
  Qed.
End Laps.

(** ** Teams that fly laps

    [turn]: from places of the last span to those of a lap before; nothing where a robot
    is not yet there. *)

Section Own.
  Variables (robots : list robot) (turn : places -> option places) (first_span : own_span).

  Definition own_turns (s : marked) : list (option letter * marked) :=
    match turn (map fst s) with Some c => own_enters first_span (combine c (map snd s)) | None => [] end.

  Definition check_own_laps (f : spec) (starts : list places) (ps : list own_span) (back : nat)
      (levels : list level) (is : list (list (entry marked))) : bool :=
    check_laps _ _ (own_moves robots) own_enters own_turns read_more
      (normal false f) (map (fun c => silent (unread c)) starts) ps back levels is.

  Lemma read_more_turned : forall c t s, read_more t s = true ->
    map fst (combine c (map snd t)) = map fst (combine c (map snd s)) /\
    read_more (combine c (map snd t)) (combine c (map snd s)) = true.
  Proof.
    induction c as [|q c IH]; intros [|[a x] t] [|[b y] s] H; try discriminate; auto.
    cbn in H; apply andb_prop in H as [H K]; apply andb_prop in H as [_ B].
    destruct (IH t s K) as [E R]; cbn; rewrite E, R, B, Nat.eqb_refl; auto.
  Qed.

  Lemma read_more_turns : forall t s o s', read_more t s = true -> In (o, s') (own_turns s) ->
    exists t', In (o, t') (own_turns t) /\ read_more t' s' = true.
  Proof.
    intros t s o s' B I; unfold own_turns in *; rewrite (read_more_places t s B).
    destruct (turn (map fst s)) as [c|]; [|destruct I].
    destruct (read_more_turned c t s B) as [E R].
    unfold own_enters in *; rewrite E; destruct (permitted _ _); [|destruct I].
    destruct I as [I|[]]; injection I as <- <-; exists (combine c (map snd t)); split; [left|]; auto.
  Qed.

  Theorem check_own_laps_sound : forall f starts ps back levels is c w,
    check_own_laps f starts ps back levels is = true -> In c starts ->
    flies _ _ (own_moves robots) own_enters own_turns ps back w None (unread c) -> sholds f w 0.
  Proof.
    intros f starts ps back levels is c w H I F; apply endless_refuted.
    apply (check_laps_sound _ _ (own_moves robots) own_enters own_turns read_more ps back
      read_more_trans (read_more_moves robots) read_more_enters read_more_turns read_more_refl
      w levels (normal false f) (map (fun c => silent (unread c)) starts) is None (unread c)); auto.
    apply in_map_iff; exists c; auto.
  Qed.
End Own.

Section Joint.
  Variables (robots : list robot) (turn : places -> option places) (first_span : joint_span).

  Definition joint_turns (c : places) : list (option letter * places) :=
    match turn c with Some c' => shows_there first_span c' | None => [] end.

  Definition check_joint_laps (f : spec) (starts : list (letter * places)) (ps : list joint_span) (back : nat)
      (levels : list level) (is : list (list (entry places))) : bool :=
    check_laps _ _ (joint_moves robots) shows_there joint_turns equal_places
      (normal false f) (map (fun m => (Some (fst m), snd m)) starts) ps back levels is.

  Theorem check_joint_laps_sound : forall f starts ps back levels is a c w,
    check_joint_laps f starts ps back levels is = true -> In (a, c) starts ->
    flies _ _ (joint_moves robots) shows_there joint_turns ps back w (Some a) c -> sholds f w 0.
  Proof.
    intros f starts ps back levels is a c w H I F; apply endless_refuted.
    apply (check_laps_sound _ _ (joint_moves robots) shows_there joint_turns equal_places ps back) with
      levels (map (fun m => (Some (fst m), snd m)) starts) is (Some a) c; auto.
    - intros x y z; rewrite !equal_places_eq; congruence.
    - intros t s p o s' E M; apply equal_places_eq in E as ->; exists s'; rewrite equal_places_eq; auto.
    - intros t s p o s' E M; apply equal_places_eq in E as ->; exists s'; rewrite equal_places_eq; auto.
    - intros t s o s' E M; apply equal_places_eq in E as ->; exists s'; rewrite equal_places_eq; auto.
    - intros s; apply equal_places_eq; auto.
    - apply in_map_iff; exists (a, c); auto.
  Qed.
End Joint.
